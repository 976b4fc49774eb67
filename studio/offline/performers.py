"""The performers of a take whose cameras show several bodies: who was known, who is found, whom the operator
exchanged.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from studio.engine.base.errors import CalibrationError
from studio.engine.identity.exchange import exchanged
from studio.engine.identity.whole_take import People, find_people
from studio.engine.model.calibration import Calibration
from studio.engine.model.frames import CameraFrame
from studio.engine.model.performers.exchange import Exchange
from studio.take.folder.known_performers import known_people
from studio.take.folder.performers import exchanges_of
from studio.take.folder.take import Take
from studio.take.raw.kept_frames import several_bodies

_Frames = Mapping[str, Sequence[CameraFrame]]


@dataclass(frozen=True)
class TakePeople:
    """Everybody in a take of several, the exchanges that were made, and the cameras that tell performers apart."""

    people: People
    exchanges: list[Exchange]
    cameras: tuple[str, ...]


def without_depth(frames: _Frames, calibration: Calibration) -> list[str]:
    """Return the cameras that do not tell performers apart, because they see no depth."""
    return [
        name for name in frames if name in calibration.cameras and calibration.cameras[name].lens is not None
    ]


def people_of(take: Take, frames: _Frames, calibration: Calibration, *, everybody: bool) -> TakePeople | None:
    """Return who is in a take; None where there is one performer, or no camera tells several apart.

    Args:
        take: it may have performers that are known already.
        frames: by camera, with all bodies.
        calibration: places the cameras.
        everybody: people without a T-pose are performers too.

    Raises:
        CalibrationError: nobody was seen for long enough.
    """
    pictures = without_depth(frames, calibration)
    if not several_bodies(frames) or len(pictures) == len(frames):
        return None
    telling = {name: mine for name, mine in frames.items() if name not in pictures}
    found = find_people(telling, calibration, known_people(take), everybody=everybody)
    if not found.performers:
        raise CalibrationError(
            "calibration.nobody",
            "the frames of {take} show several bodies, but nobody for a second at a time; place the cameras so "
            "that they see the performers, and calibrate again",
            take=take.path,
        )
    people, made = exchanged(found, calibration, exchanges_of(take.meta))
    return TakePeople(people, made, tuple(telling))
