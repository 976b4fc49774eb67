"""The persons on the stage, and the persons of the bodies in cameras' frames."""

from dataclasses import dataclass

from studio.engine.model.frames import CameraFrame

FIRST = 1
"""Number of the performer with the calibration's proportions."""

MOST_PERFORMERS = 8
"""Maximum number of performers; further ones are reported and left out."""

LEAST_FRAMES, LEAST_SPAN_S = 45, 3.0
"""Least number of frames of one camera, and least time that they span, to measure a person without a T-pose."""


def performer_key(number: int) -> str:
    """Return a performer's name until they are named, which is also their folder: `performer_1`, ..."""
    return f"performer_{number}"


@dataclass(frozen=True)
class Recognised:
    """The person of a camera's body: index of the person, and number of the performer, None = a stranger."""

    person: int
    performer: int | None
    frame: CameraFrame


@dataclass(frozen=True)
class OnStage:
    """A known person.

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
