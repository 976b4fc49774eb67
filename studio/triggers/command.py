"""What a trigger asks for."""

from dataclasses import dataclass
from typing import Literal


@dataclass(frozen=True)
class TriggerCommand:
    """A request to start or stop a recording, or to tell its state.

    Attributes:
        kind: what is asked for.
        name, session: of the take; "" = not said.
        notes: for the slate.
        timecode: as the sender has it, "" = not said.
        packet: names the request among those of its sender, "" = not said; a second one of that name does nothing.
        success: of a stop: whether its sender calls the take good.
        token: as said, "" = none.
    """

    kind: Literal["start", "stop", "toggle", "state"]
    name: str = ""
    session: str = ""
    notes: str = ""
    timecode: str = ""
    packet: str = ""
    success: bool = True
    token: str = ""
