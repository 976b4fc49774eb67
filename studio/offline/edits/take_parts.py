"""Parts of takes, from which a take is spliced."""

from dataclasses import dataclass

from studio.take.folder.take import Take

BLEND_S = 0.8
NEAR_S = 0.6
"""Default length of a seam, and default largest shift of a part's beginning [s]: more than half of a walk's cycle
of two steps."""


@dataclass(frozen=True)
class TakePart:
    """A part of a solve of a take.

    Attributes:
        take: with solves.
        start_s, end_s: stage time [s]; None = from the first frame, to the last.
        since_begin: the times count from the solve's first frame instead.
        solve: its name; None = finish, studio, live, or the first by name.
        performer: one of several; None = the first.
    """

    take: Take
    start_s: float | None = None
    end_s: float | None = None
    solve: str | None = None
    performer: str | None = None
    since_begin: bool = False
