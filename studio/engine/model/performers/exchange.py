"""An exchange of two performers of a take, as the operator asks for it."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Exchange:
    """From `time_s` on (stage time [s]) the frames of two performers, `performer_1`, ..., are those of the other."""

    time_s: float
    performers: tuple[str, str]
