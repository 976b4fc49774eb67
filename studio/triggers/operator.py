"""Effect of a trigger: starts or stops the recording, once for each request.

A duplicate packet has the `packet` of an earlier one and does nothing. A start while a take is recorded does nothing,
and so does a stop that names another take; a stop without a name ends any take. A start that arrives after its own
stop is late and does nothing.
"""

import hmac
import threading
import time
from collections import OrderedDict
from collections.abc import Callable
from typing import Protocol

from studio.engine.base.errors import StudioError
from studio.engine.base.sentences import say
from studio.take.folder.names import safe_name
from studio.triggers.command import TriggerCommand

_MOST_PACKETS = 256
DOUBLED_S = 1.0
"""Time within which equal named requests of one sender without a packet number are duplicates."""

LATE_S = 2.0


class Recorded(Protocol):
    """The live stage, as a trigger operates it."""

    def recording_name(self) -> str | None:
        """Return `<session>/<take>` of the current recording, or None."""
        ...

    def start_trigger(self, session: str | None, take: str | None, notes: str) -> str:
        """Start a take and return its name; a name that is taken gets the next free number appended."""
        ...

    def stop_trigger(self) -> str:
        """End the take and return its name."""
        ...


class TriggerOperator:
    """Performs the commands of all triggers, one after the other; thread-safe.

    Args:
        stage: the live stage.
        token: token that every command must have; "" = none is required.
        now_s: a monotonic clock [s].
    """

    def __init__(self, stage: Recorded, token: str = "", now_s: Callable[[], float] = time.monotonic) -> None:
        self._stage = stage
        self.token = token
        self._now_s = now_s
        self._lock = threading.Lock()
        self._packets: OrderedDict[tuple[str, ...], float] = OrderedDict()
        self._stopped: OrderedDict[str, float] = OrderedDict()
        self._wanted = ""

    def perform(self, command: TriggerCommand, sender: str, *, has_token: bool = True) -> str:
        """Perform a command; return why nothing was done, "" if it was performed.

        Args:
            command: the command.
            sender: its source; packet numbers belong to a sender.
            has_token: whether its protocol has room for a token; a MIDI note has none.
        """
        if self.token and has_token and not hmac.compare_digest(command.token.encode(), self.token.encode()):
            return say("trigger.token", "the token is missing or wrong")
        if command.kind == "state":
            return ""
        with self._lock:
            if self._is_doubled(command, sender):
                return say("trigger.doubled", "the packet came before")
            under_way = self._stage.recording_name()
            start = command.kind == "start" or (command.kind == "toggle" and under_way is None)
            try:
                why = self._start(command, under_way) if start else self._stop(command, under_way)
            except StudioError as error:
                return error.sentence
            if not why:
                self._remember(command, sender)
            return why

    def _is_doubled(self, command: TriggerCommand, sender: str) -> bool:
        before = self._packets.get(_key(command, sender))
        if before is None or command.kind == "toggle":
            return False
        return bool(command.packet) or (bool(command.name) and self._now_s() - before < DOUBLED_S)

    def _remember(self, command: TriggerCommand, sender: str) -> None:
        """Remember a performed command, so that it is not performed twice."""
        key = _key(command, sender)
        self._packets[key] = self._now_s()
        self._packets.move_to_end(key)
        while len(self._packets) > _MOST_PACKETS:
            self._packets.popitem(last=False)

    def _start(self, command: TriggerCommand, under_way: str | None) -> str:
        if under_way is not None:
            if command.name and command.name == self._wanted:
                return say("trigger.runs", "this take is being recorded already")
            return say("trigger.under_way", "take {name} is being recorded; stop it first", name=under_way)
        stopped_s = self._stopped.get(command.name) if command.name else None
        if stopped_s is not None and self._now_s() - stopped_s < LATE_S:
            return say("trigger.late", "its stop came before it")
        name = safe_name(command.name, "take") if command.name else None
        session = safe_name(command.session, "set") if command.session else None
        self._stage.start_trigger(session, name, command.notes)
        self._wanted = command.name
        return ""

    def _stop(self, command: TriggerCommand, under_way: str | None) -> str:
        if under_way is None:
            if command.name:
                self._stopped[command.name] = self._now_s()
                while len(self._stopped) > _MOST_PACKETS:
                    self._stopped.popitem(last=False)
            return say("trigger.nothing", "nothing is being recorded")
        own = under_way.partition("/")[2]
        if command.name and command.name != self._wanted and safe_name(command.name, "take") != own:
            return say(
                "trigger.another", "take {name} is being recorded, not the one to stop", name=under_way
            )
        self._stage.stop_trigger()
        self._wanted = ""
        return ""


def _key(command: TriggerCommand, sender: str) -> tuple[str, ...]:
    return sender, command.kind, command.name, command.session, command.packet
