"""First look: a part of a take with changed settings, shown before the whole take is solved."""

from bisect import bisect_left, bisect_right
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import lru_cache, partial
from pathlib import Path

import numpy as np

from studio.engine.calibration.calibrate import with_performer
from studio.engine.calibration.result import Calibration
from studio.engine.errors import TakeError
from studio.engine.export.resample import frames_of
from studio.engine.frames import CameraFrame, ClockModel
from studio.engine.poses import Poses
from studio.engine.settings import SolveSettings
from studio.engine.solve.take import solve_frames
from studio.take.raw import camera_frames
from studio.take.take import Take
from studio.tracking import is_tracked, tracked_frames

LEAD_S = 1.0
"""How long before a part its solve begins: by then the filter has found the body."""

_FileState = tuple[Path, int, int]


def solve_part(
    take: Take,
    settings: SolveSettings,
    start_s: float,
    end_s: float,
    *,
    progress: Callable[[float], None] | None = None,
) -> Poses:
    """Return the poses from `start_s` to `end_s` of stage time as a solve that begins shortly before gives them.

    Without finishing and physics, which need the whole take, and nothing is kept. Skeletons from depth are those that
    an earlier solve or calibration tracked.

    Raises:
        CalibrationError: the take has no calibration, or no performer. TakeError: no frames there, no raw frames, or
            depth that was not tracked with these settings yet.
    """
    settings = replace(settings, finish="off", physics="off")
    take.calibration()  # says what is wrong where there is none
    file = take.calibration_path(take.meta["calibration"])
    tracked_as = (settings.tracker, settings.cameras) if is_tracked(take, settings) else None
    frames, calibration = _recent(take.path, _state(take.raw_path), _state(file), tracked_as)
    if tracked_as is not None:
        settings = replace(settings, cameras="all")  # only those that are used were tracked
    clocks = {name: camera.clock for name, camera in calibration.cameras.items()}
    first_ns, last_ns = (start_s - LEAD_S) * 1e9, end_s * 1e9
    part: list[CameraFrame] = []
    for name, mine in frames.items():
        if name in clocks:
            stage_ns = partial(_stage_ns, clocks[name])
            begin, end = bisect_left(mine, first_ns, key=stage_ns), bisect_right(mine, last_ns, key=stage_ns)
            part.extend(mine[begin:end])
    poses = solve_frames(part, calibration, settings, progress=progress)
    shown = (poses.time_s >= start_s) & (poses.time_s <= end_s)
    if not shown.any():
        raise TakeError(f"{take.path} has no frames from {start_s:g} to {end_s:g} s")
    first, last = np.flatnonzero(shown)[[0, -1]]
    return frames_of(poses, slice(int(first), int(last) + 1))


def _stage_ns(clock: ClockModel, frame: CameraFrame) -> int:
    return clock.stage_ns(frame.device_time_ns)


def _state(file: Path) -> _FileState:
    """Return the file with its time and size, which tell whether it has changed since it was read."""
    state = file.stat()
    return file, state.st_mtime_ns, state.st_size


@lru_cache(maxsize=1)
def _recent(
    path: Path, raw: _FileState, calibration: _FileState, tracked_as: tuple[str, str] | None
) -> tuple[Mapping[str, Sequence[CameraFrame]], Calibration]:
    """Return the frames of the take looked at last, and its calibration with what they show of the performer.

    Args:
        tracked_as: `tracker` and `cameras` where the skeletons come from depth.
    """
    take = Take.open(path)
    found = take.calibration()
    if tracked_as is None:
        frames = camera_frames(take.raw_path)
    else:
        tracker, cameras = tracked_as
        settings = SolveSettings(tracker=tracker, cameras=cameras)
        frames, found, _ = tracked_frames(take, found, settings, only_kept=True)
    return frames, with_performer(found, frames)
