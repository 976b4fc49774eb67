"""Replay: a take's raw frames through the pipeline again, with any settings or exactly as it was live."""

import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from studio.engine.calibration.calibrate import with_performer
from studio.engine.errors import CalibrationError, TakeError
from studio.engine.export.resample import frames_of
from studio.engine.frames import CameraFrame, StepResult
from studio.engine.poses import Poses
from studio.engine.settings import SolveSettings
from studio.engine.solve.collect import collect_poses
from studio.engine.solve.following import Following
from studio.engine.solve.take import check_together, solve_frames
from studio.engine.solve.trace import TraceCollector
from studio.live.log import LoggedPipeline
from studio.take.raw import RawEvent, RawFrame, camera_frames, inspect_raw, read_raw
from studio.take.solves import write_solve
from studio.take.take import Take
from studio.tracking import tracked_frames

Progress = Callable[[float], None]
"""Told the share that is done, 0..1."""

LEAD_S = 1.0
"""How long before a part its solve begins: by then the filter has found the body."""


def solve_take(
    take: Take,
    settings: SolveSettings,
    *,
    name: str,
    as_live: bool = False,
    progress: Progress | None = None,
) -> Path:
    """Solve a take and write `solves/<name>/`; return that folder.

    Args:
        take: with raw frames.
        settings: the switches; with `as_live` those of the recording are used instead.
        name: of the solve; one of that name is replaced.
        as_live: repeat the decisions of the live stage, whose poses come out bit for bit; else all frames are
            used, with the final clocks of the calibration, and the calibration part is left out.
        progress: told the share done.

    Raises:
        TakeError: no raw frames, no live log, or a name that is not allowed.
        CalibrationError: the take has no calibration. SettingsError: a camera that the take does not have.
    """
    take.solve_folder(name)  # a bad name is told before the work, not after
    began, following, trace = time.perf_counter(), Following(), TraceCollector()
    physics: dict[str, Any] = {}
    if as_live:
        poses, settings, camera_frame_count = _as_live(take, progress, following, trace)
    else:
        poses, camera_frame_count = _plain(take, settings, progress, following, physics, trace)
    seconds = time.perf_counter() - began
    metrics = {
        "frames": poses.frame_count,
        "camera_frames": camera_frame_count,
        "as_live": as_live,
        "solve_s": round(seconds, 3),
        "ms_per_frame": round(seconds * 1e3 / max(poses.frame_count, 1), 4),
        "frames_per_second": round(poses.frame_count / seconds, 1),
        **following.figures(),
        **physics,
    }
    return write_solve(take, name, settings=settings, poses=poses, metrics=metrics, trace=trace.trace())


def _plain(
    take: Take,
    settings: SolveSettings,
    progress: Progress | None,
    following: Following,
    physics: dict[str, Any],
    trace: TraceCollector,
) -> tuple[Poses, int]:
    check_together(settings)
    calibration = take.calibration()
    tracked = tracked_frames(take, calibration, settings, progress)
    if tracked is None:
        frames = camera_frames(take.raw_path)
    else:
        frames, calibration, settings = tracked
    calibration = with_performer(calibration, frames)
    if calibration.performer is None:
        raise CalibrationError(
            f"the calibration of {take.path} has no performer and the frames show none; "
            f"run `studio calibrate {take.path}`"
        )
    start_s, count = take.meta["calibration_s"], sum(len(camera) for camera in frames.values())
    poses = solve_frames(
        _handed_over(frames),
        calibration,
        settings,
        start_s=start_s,
        progress=progress,
        following=following,
        physics=physics,
        trace=trace,
    )
    return poses, count


def solve_part(
    take: Take, settings: SolveSettings, start_s: float, end_s: float, *, progress: Progress | None = None
) -> Poses:
    """Return the poses from `start_s` to `end_s` of stage time as a solve that begins shortly before gives them.

    A first look at what settings do: without finishing and physics, which need the whole take, and nothing is kept.

    Raises:
        CalibrationError: the take has no calibration, or no performer. TakeError: no frames there, or no raw frames.
    """
    settings = replace(settings, finish="off", physics="off")
    state = take.raw_path.stat()
    frames = _recent_frames(take.raw_path, state.st_mtime_ns, state.st_size)
    calibration = with_performer(take.calibration(), frames)
    clocks = {name: camera.clock for name, camera in calibration.cameras.items()}
    first_ns, last_ns = (start_s - LEAD_S) * 1e9, end_s * 1e9
    part = [
        frame
        for name, mine in frames.items()
        if name in clocks
        for frame in mine
        if first_ns <= clocks[name].stage_ns(frame.device_time_ns) <= last_ns
    ]
    poses = solve_frames(part, calibration, settings, progress=progress)
    shown = (poses.time_s >= start_s) & (poses.time_s <= end_s)
    if not shown.any():
        raise TakeError(f"{take.path} has no frames from {start_s:g} to {end_s:g} s")
    first, last = np.flatnonzero(shown)[[0, -1]]
    return frames_of(poses, slice(int(first), int(last) + 1))


@lru_cache(maxsize=1)
def _recent_frames(path: Path, _mtime_ns: int, _size: int) -> dict[str, list[CameraFrame]]:
    """Return the frames of the take that was looked at last; times and size tell whether it has changed since."""
    return camera_frames(path)


def _handed_over(frames: dict[str, list[CameraFrame]]) -> Iterator[CameraFrame]:
    """Yield all frames and keep none: an hour of them fills memory."""
    for camera in frames.values():
        camera.reverse()
        while camera:
            yield camera.pop()


def _as_live(
    take: Take, progress: Progress | None, following: Following, trace: TraceCollector
) -> tuple[Poses, SolveSettings, int]:
    summary = inspect_raw(take.raw_path)
    if summary.events == 0:
        raise TakeError(
            f"{take.path} has no live log: it was not recorded live, so there is nothing to repeat; "
            "solve it without --as-live"
        )
    total = max(sum(summary.frames.values()), 1)
    pipeline = LoggedPipeline()
    results: list[StepResult] = []
    done = 0
    for record in read_raw(take.raw_path):
        if isinstance(record, RawFrame):
            if not record.late:  # the live solve was past those
                pipeline.frame(record.frame)
            done += 1
            if progress is not None and done % 64 == 0:
                progress(done / total)
        elif isinstance(record, RawEvent):
            result = pipeline.event(record.event)
            if result is not None:
                results.append(result)
                following.add(result)
                trace.add(result)
    if progress is not None:
        progress(1.0)
    if pipeline.settings is None:
        raise TakeError(f"the live log of {take.path} has no beginning; run `studio doctor`")
    return collect_poses(results), pipeline.settings, done
