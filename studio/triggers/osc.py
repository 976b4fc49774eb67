"""OSC over UDP: `/record/start [name [session]]`, `/record/stop`, `/record/state`, all answered by `/record/state`.

The answer has `recording` or `idle`, the take as session/name, the current timecode, and why the request did nothing
(else empty). If a token is set, it is the last argument of every request. Source: Open Sound Control 1.0.
"""

from pythonosc.osc_message_builder import OscMessageBuilder

from studio.triggers.command import TriggerCommand
from studio.wire.osc import NotOscError, OscMessage, osc_messages

PORT = 9500
LONGEST = 8192
_KINDS = {"/record/start": "start", "/record/stop": "stop", "/record/state": "state"}
_MOST = 16
_LONGEST_TEXT = 1000
ANSWER = "/record/state"


def parse_osc(data: bytes, *, with_token: bool) -> list[TriggerCommand] | None:
    """Return the requests in a packet, in order; None if it is no OSC or has none of the addresses.

    Args:
        data: a message or a bundle.
        with_token: whether the last argument is a token.
    """
    if not data or len(data) > LONGEST or len(data) % 4:
        return None
    try:
        messages = osc_messages(data)
    except NotOscError:
        return None
    found = [_command(message, with_token) for message in messages]
    return [one for one in found if one is not None][:_MOST] or None


def _command(message: OscMessage, with_token: bool) -> TriggerCommand | None:
    kind = _KINDS.get(message.address)
    if kind is None:
        return None
    texts = [_words(one)[:_LONGEST_TEXT].strip() for one in message.arguments]
    token = texts.pop() if with_token and texts else ""
    name, session = (*texts, "", "")[:2]
    if kind == "start":
        return TriggerCommand("start", name=name, session=session, token=token)
    return TriggerCommand("stop" if kind == "stop" else "state", token=token)


def _words(argument: str | float | None) -> str:
    """Return an argument as text; a number without superfluous digits."""
    if argument is None:
        return ""
    return argument if isinstance(argument, str) else f"{argument:.15g}"


def state_message(recording: bool, take: str, timecode: str, problem: str) -> bytes:
    """Return the answer."""
    builder = OscMessageBuilder(ANSWER)
    for text in ("recording" if recording else "idle", take, timecode, problem):
        builder.add_arg(text)
    return builder.build().dgram
