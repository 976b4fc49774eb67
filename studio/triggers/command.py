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
        packet: identifies the request among those of its sender, "" = not given; a second one with it does nothing.
        success: for a stop, whether its sender calls the take good.
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
