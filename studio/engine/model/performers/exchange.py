"""An exchange of two performers of a take, requested by the operator."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Exchange:
    """Exchange of the frames of two performers, `performer_1`, ..., from `time_s` on (stage time [s])."""

    time_s: float
    performers: tuple[str, str]
