"""Replay: a take's raw frames through the pipeline again, with any settings or exactly as it was live."""

import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from studio.engine.calibration.calibrate import with_performer
from studio.engine.errors import CalibrationError, TakeError
from studio.engine.frames import StepResult
from studio.engine.poses import Poses
from studio.engine.settings import SolveSettings
from studio.engine.solve.collect import collect_poses
from studio.engine.solve.following import Following
from studio.engine.solve.take import check_together, solve_frames
from studio.engine.solve.trace import TraceCollector
from studio.live.log import LoggedPipeline
from studio.take.kept_frames import Joined
from studio.take.raw import RawEvent, RawFrame, camera_frames, inspect_raw, read_raw
from studio.take.solves import write_solve
from studio.take.take import Take
from studio.tracking import is_tracked, tracked_frames

Progress = Callable[[float], None]
"""Told the share that is done, 0..1."""


def solve_take(
    take: Take,
    settings: SolveSettings,
    *,
    name: str,
    as_live: bool = False,
    progress: Progress | None = None,
    to_disk: bool = True,
) -> Path:
    """Solve a take and write `solves/<name>/`; return that folder.

    Args:
        take: with raw frames.
        settings: the switches; with `as_live` those of the recording are used instead.
        name: of the solve; one of that name is replaced.
        as_live: repeat the decisions of the live stage, whose poses come out bit for bit; else all frames are
            used, with the final clocks of the calibration, and the calibration part is left out.
        progress: told the share done.
        to_disk: see `write_solve`.

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
    return write_solve(
        take, name, settings=settings, poses=poses, metrics=metrics, trace=trace.trace(), to_disk=to_disk
    )


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
    if is_tracked(take, settings):
        frames, calibration, settings = tracked_frames(take, calibration, settings, progress)
    else:
        frames = camera_frames(take.raw_path)
    calibration = with_performer(calibration, frames)
    if calibration.performer is None:
        raise CalibrationError(
            f"the calibration of {take.path} has no performer and the frames show none; "
            f"run `studio calibrate {take.path}`"
        )
    every = Joined(list(frames.values()))
    poses = solve_frames(
        every,
        calibration,
        settings,
        start_s=take.meta["calibration_s"],
        progress=progress,
        following=following,
        physics=physics,
        trace=trace,
    )
    return poses, len(every)


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
