"""Preview: a part of a take solved with changed settings, before the whole take is solved."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from pathlib import Path

import numpy as np

from studio.engine.animation.clip.resample import frames_of
from studio.engine.base.errors import TakeError
from studio.engine.base.files import FileStamp, file_stamp
from studio.engine.calibration.calibrate import with_performer
from studio.engine.edits.edit import Edit
from studio.engine.edits.frames import places_between, stage_s
from studio.engine.model.calibration import Calibration
from studio.engine.model.frames import CameraFrame
from studio.engine.model.performers.exchange import Exchange
from studio.engine.model.poses import Poses
from studio.engine.model.settings.settings import SolveSettings
from studio.engine.whole_take.mending.floor import FeetSeen, feet_seen, is_raised_for_pins, places_feet
from studio.engine.whole_take.take import solve_frames
from studio.offline.performers import people_of
from studio.offline.tracking import is_tracked, tracked_frames
from studio.take.folder.performers import exchanges_of
from studio.take.folder.take import PERFORMER, Take
from studio.take.raw.frames import camera_frames

LEAD_S = 1.0
"""Lead-in of a part's solve, in which the filter converges."""


def solve_part(
    take: Take,
    settings: SolveSettings,
    start_s: float,
    end_s: float,
    *,
    performer: str = "",
    progress: Callable[[float], None] | None = None,
) -> Poses:
    """Return the poses from `start_s` to `end_s` of stage time, from a solve that begins shortly before.

    The solve is without finishing and physics, which need the whole take, and nothing is stored. Skeletons from depth
    are those of an earlier solve or calibration. `performer`: one of several; the first where empty.

    Raises:
        CalibrationError: the take has no calibration, or no performer.
        TakeError: no frames in this part, no raw frames, or depth not yet tracked with these settings.
    """
    settings = replace(settings, finish="off", physics="off")
    one = seen_performer(take, settings, performer)
    settings, calibration = one.settings, one.calibration
    part: list[CameraFrame] = []
    for name, mine in one.frames.items():
        if name in calibration.cameras:
            part.extend(frames_between(mine, calibration, name, start_s - LEAD_S, end_s))
    poses = solve_frames(part, calibration, settings, progress=progress)
    return poses_between(take, poses, start_s, end_s)


def poses_between(take: Take, poses: Poses, start_s: float, end_s: float) -> Poses:
    """Return the poses of a take between two stage times [s], both included.

    Raises:
        TakeError: there are none.
    """
    shown = (poses.time_s >= start_s) & (poses.time_s <= end_s)
    if not shown.any():
        raise TakeError(
            "take.no_frames_between",
            "{path} has no frames from {start:g} to {end:g} s",
            path=take.path,
            start=start_s,
            end=end_s,
        )
    first, last = np.flatnonzero(shown)[[0, -1]]
    return frames_of(poses, slice(int(first), int(last) + 1))


@dataclass(frozen=True)
class SeenPerformer:
    """A performer of a take: their name, the settings of their solve, and their cached data."""

    name: str
    settings: SolveSettings
    _kept: "_KeptPerformer"

    @property
    def frames(self) -> Mapping[str, Sequence[CameraFrame]]:
        """Their frames by camera."""
        return self._kept.frames

    @property
    def calibration(self) -> Calibration:
        """The take's calibration, with them as its performer."""
        return self._kept.calibration

    def lift_of_pins_m(self, edits: Sequence[Edit]) -> float:
        """Return `lift_of_pins_m` of their frames; the feet are evaluated once."""
        if not is_raised_for_pins(self.calibration, self.settings, edits) or self._kept.feet is None:
            return 0.0
        return self._kept.feet.lift_of_pins_m(edits)

    def read_feet(self) -> None:
        """Evaluate the feet, where a pin may need them."""
        if places_feet(self.calibration, self.settings):
            _ = self._kept.feet


def seen_performer(take: Take, settings: SolveSettings, performer: str) -> SeenPerformer:
    """Return a performer of a take as a solve with these settings takes them; the data of the last take are cached.

    Args:
        performer: of several; the first where there is none of this name.

    Raises:
        CalibrationError: the take has no calibration, or no performer.
        TakeError: no raw frames, or depth not yet tracked with these settings.
    """
    take.calibration()  # raises the right error if there is none
    number = take.meta["calibration"]
    assert number is not None
    file = take.calibration_path(number)
    tracked_as = (
        (settings.tracker, settings.cameras, settings.refine_cameras) if is_tracked(take, settings) else None
    )
    people = _recent(
        take.path,
        file_stamp(take.raw_path),
        (file, file_stamp(file)),
        tracked_as,
        exchanges_of(take.meta),
        settings.everybody,
    )
    performer = performer if performer in people else next(iter(people))
    kept, settings = people[performer], settings.of_performer(performer)
    if tracked_as is not None:
        settings = replace(settings, cameras="all")  # only the used ones were tracked
    return SeenPerformer(performer, settings, kept)


def frames_between(
    frames: Sequence[CameraFrame], calibration: Calibration, camera: str, begin_s: float, end_s: float
) -> Sequence[CameraFrame]:
    """Return a camera's frames between two stage times [s]."""
    places = places_between(frames, stage_s(calibration, camera), begin_s, end_s)
    return frames[places.start : places.stop]


@lru_cache(maxsize=1)
def _recent(
    path: Path,
    raw: FileStamp,
    calibration: tuple[Path, FileStamp],
    tracked_as: tuple[str, str, str] | None,
    exchanges: tuple[Exchange, ...],
    everybody: bool,
) -> dict[str, "_KeptPerformer"]:
    """Return the data of a take by performer; those of the last take are cached.

    Args:
        tracked_as: `tracker`, `cameras` and `refine_cameras` for skeletons from depth.
        exchanges: of performers, as the take has them; others need other frames.
        everybody: see `people_of`.
    """
    take = Take.open(path)
    found = take.calibration()
    if tracked_as is None:
        frames = camera_frames(take.raw_path)
    else:
        tracker, cameras, refine = tracked_as
        settings = SolveSettings(tracker=tracker, cameras=cameras, refine_cameras=refine)
        frames, found, *_ = tracked_frames(take, found, settings, only_kept=True)
    several, start_s = people_of(take, frames, found, everybody=everybody), take.meta["calibration_s"]
    if several is None:
        return {PERFORMER: _KeptPerformer(frames, with_performer(found, frames), start_s)}
    return {
        one.name: _KeptPerformer(one.frames, with_performer(one.calibration, one.frames), start_s)
        for one in several.people.performers
    }


class _KeptPerformer:
    """The frames of a performer by camera, and the calibration with the performer that they show.

    Attributes:
        start_s: end of the calibration part, stage time [s]; None = there is none.
    """

    def __init__(
        self, frames: Mapping[str, Sequence[CameraFrame]], calibration: Calibration, start_s: float | None
    ) -> None:
        self.frames, self.calibration, self.start_s = frames, calibration, start_s

    @cached_property
    def feet(self) -> FeetSeen | None:
        """The performer's feet as cameras see them."""
        return feet_seen(self.frames, self.calibration, self.start_s)
