"""Who is on the stage, and whose bodies cameras show."""

from dataclasses import dataclass

from studio.engine.model.frames import CameraFrame

FIRST = 1
"""Number of the performer with the calibration's proportions."""

MOST_PERFORMERS = 8
"""Further ones are told and left out."""

LEAST_FRAMES, LEAST_SPAN_S = 45, 3.0
"""Whom no camera shows so often, over such a time, is nobody to be measured without a T-pose."""


def performer_key(number: int) -> str:
    """Return what a performer is called until they are named, and their folder: `performer_1`, ..."""
    return f"performer_{number}"


@dataclass(frozen=True)
class Recognised:
    """A camera's body and whose it is: index of the person, and number of the performer, None = a stranger."""

    person: int
    performer: int | None
    frame: CameraFrame


@dataclass(frozen=True)
class OnStage:
    """Somebody who is known.

    Attributes:
        performer: number, from 1; None = a stranger.
        height_m: None = not measured.
        here: a camera sees them now.
        undecided: they cannot be told apart from another now.
    """

    performer: int | None
    height_m: float | None
    here: bool
    undecided: bool
