"""The request of a trigger."""

from dataclasses import dataclass
from typing import Literal


@dataclass(frozen=True)
class TriggerCommand:
    """A request to start or stop a recording, or to report its state.

    Attributes:
        kind: kind of request.
        name, session: names of the take and its session; "" = not given.
        notes: notes for the slate.
        timecode: the sender's timecode, "" = not given.
        packet: the sender's identifier of the request, "" = not given; a second request with it does nothing.
        success: for a stop, whether its sender marks the take as good.
        token: the given token, "" = none.
    """

    kind: Literal["start", "stop", "toggle", "state"]
    name: str = ""
    session: str = ""
    notes: str = ""
    timecode: str = ""
    packet: str = ""
    success: bool = True
    token: str = ""
