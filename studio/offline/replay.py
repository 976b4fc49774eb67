"""Replay: a take's raw frames through the pipeline again, with any settings or exactly as live."""

import time
from collections.abc import Callable
from pathlib import Path

from studio.engine.base.errors import CalibrationError, TakeError
from studio.engine.calibration.calibrate import with_performer
from studio.engine.calibration.quality.agreement import agreement_figures, disagreements, without_named
from studio.engine.model.frames import StepResult
from studio.engine.model.poses import Poses
from studio.engine.model.settings import SolveSettings
from studio.engine.model.solve_metrics import SolveMetrics
from studio.engine.whole_take.collect import collect_poses
from studio.engine.whole_take.residuals import SolveResiduals
from studio.engine.whole_take.take import check_together, solve_frames
from studio.engine.whole_take.trace import TraceCollector
from studio.offline.so_far import Show
from studio.offline.tracking import is_tracked, tracked_frames
from studio.take.folder.solves import write_solve
from studio.take.folder.take import Take
from studio.take.raw.frames import RawEvent, RawFrame, camera_frames, inspect_raw, read_raw
from studio.take.raw.kept_frames import Joined
from studio.take.raw.live_log import LoggedPipeline

Progress = Callable[[float], None]
"""Receives the share done, 0..1."""


def solve_take(
    take: Take,
    settings: SolveSettings,
    *,
    name: str,
    as_live: bool = False,
    progress: Progress | None = None,
    to_disk: bool = True,
    show: Show | None = None,
    processes: int | None = None,
) -> Path:
    """Solve a take and write `solves/<name>/`; return that folder.

    Args:
        take: with raw frames.
        settings: the switches; with `as_live` those of the recording are used instead.
        name: of the solve; one of that name is replaced.
        as_live: repeat the decisions of the live stage, which gives its poses bit for bit; else all frames are
            used, with the final clocks of the calibration, and the calibration part is left out.
        progress: receives the share done.
        to_disk: see `write_solve`.
        show: receives what the solve has so far, where it tracks depth first.
        processes: how many may track cameras side by side; None = one a core.

    Raises:
        TakeError: no raw frames, no live log, or a name that is not allowed.
        CalibrationError: the take has no calibration.
        SettingsError: the take lacks a named camera.
    """
    take.solve_folder(name)  # reports a bad name before the work
    began, residuals, trace = time.perf_counter(), SolveResiduals(), TraceCollector()
    figures: SolveMetrics = {}
    if as_live:
        poses, settings, camera_frame_count = _as_live(take, progress, residuals, trace)
    else:
        poses, camera_frame_count = _plain(
            take, settings, progress, residuals, figures, trace, show, processes
        )
    seconds = time.perf_counter() - began
    metrics: SolveMetrics = {
        "frames": poses.frame_count,
        "camera_frames": camera_frame_count,
        "as_live": as_live,
        "solve_s": round(seconds, 3),
        "ms_per_frame": round(seconds * 1e3 / max(poses.frame_count, 1), 4),
        "frames_per_second": round(poses.frame_count / seconds, 1),
        **residuals.figures(),
        **figures,
    }
    return write_solve(
        take, name, settings=settings, poses=poses, metrics=metrics, trace=trace.trace(), to_disk=to_disk
    )


def _plain(
    take: Take,
    settings: SolveSettings,
    progress: Progress | None,
    residuals: SolveResiduals,
    figures: SolveMetrics,
    trace: TraceCollector,
    show: Show | None,
    processes: int | None,
) -> tuple[Poses, int]:
    check_together(settings)
    calibration = take.calibration()
    if is_tracked(take, settings):
        frames, calibration, settings, told = tracked_frames(
            take, calibration, settings, progress, show=show, processes=processes
        )
        figures |= told
    else:
        frames = camera_frames(take.raw_path)
    calibration = with_performer(calibration, frames)
    if calibration.performer is None:
        raise CalibrationError(
            "calibration.no_performer",
            "the calibration of {take} has no performer and the frames show none; run `studio "
            "calibrate {take}`",
            take=take.path,
        )
    used = {
        name: frames[name] for name in settings.camera_names(tuple(calibration.cameras)) if name in frames
    }
    found = disagreements(calibration, used, from_s=take.meta["calibration_s"])
    every = Joined(list(without_named(calibration, frames, found).values()))
    physics: SolveMetrics = {}
    poses = solve_frames(
        every,
        calibration,
        settings,
        start_s=take.meta["calibration_s"],
        progress=progress,
        residuals=residuals,
        physics=physics,
        trace=trace,
    )
    figures |= agreement_figures(found, float(poses.time_s[0])) | physics
    return poses, len(every)


def _as_live(
    take: Take, progress: Progress | None, residuals: SolveResiduals, trace: TraceCollector
) -> tuple[Poses, SolveSettings, int]:
    summary = inspect_raw(take.raw_path)
    if summary.events == 0:
        raise TakeError(
            "take.no_live_log",
            "{path} has no live log: it was not recorded live, so there is nothing to repeat; "
            "solve it without --as-live",
            path=take.path,
        )
    total = max(sum(summary.frames.values()), 1)
    pipeline = LoggedPipeline()
    results: list[StepResult] = []
    done = 0
    for record in read_raw(take.raw_path):
        if isinstance(record, RawFrame):
            if not record.late:  # the live solve did not use late frames
                pipeline.frame(record.frame)
            done += 1
            if progress is not None and done % 64 == 0:
                progress(done / total)
        elif isinstance(record, RawEvent):
            result = pipeline.event(record.event)
            if result is not None:
                results.append(result)
                residuals.add(result)
                trace.add(result)
    if progress is not None:
        progress(1.0)
    if pipeline.settings is None:
        raise TakeError(
            "take.log_no_beginning",
            "the live log of {path} has no beginning; run `studio doctor`",
            path=take.path,
        )
    return collect_poses(results), pipeline.settings, done
