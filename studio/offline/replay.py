"""Replay: a take's raw frames through the pipeline again, with any settings or exactly as live."""

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from studio.engine.base.errors import CalibrationError, TakeError
from studio.engine.calibration.calibrate import with_performer
from studio.engine.calibration.quality.agreement import agreement_figures, disagreements, without_named
from studio.engine.identity.exchange import exchanged
from studio.engine.identity.whole_take import find_people, spans
from studio.engine.model.calibration import Calibration
from studio.engine.model.frames import CameraFrame, StepResult
from studio.engine.model.settings import SolveSettings
from studio.engine.model.solve_metrics import SolveMetrics
from studio.engine.whole_take.collect import collect_poses
from studio.engine.whole_take.residuals import SolveResiduals
from studio.engine.whole_take.take import check_together, part_of_progress, solve_frames
from studio.engine.whole_take.trace import TraceCollector
from studio.offline.so_far import Show
from studio.offline.tracking import is_tracked, tracked_frames
from studio.take.folder.known import known_people
from studio.take.folder.performers import exchange_json, exchanges_of
from studio.take.folder.solves import Solved, write_performers
from studio.take.folder.take import PERFORMER, Take
from studio.take.raw.frames import RawEvent, RawFrame, camera_frames, inspect_raw, read_raw
from studio.take.raw.kept_frames import Joined, several_bodies
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
        to_disk: see `write_performers`.
        show: receives what the solve has so far, where it tracks depth first.
        processes: how many may track cameras side by side; None = one a core.

    Raises:
        TakeError: no raw frames, no live log, or a name that is not allowed.
        CalibrationError: the take has no calibration.
        SettingsError: the take lacks a named camera.
    """
    take.solve_folder(name)  # reports a bad name before the work
    began = time.perf_counter()
    if as_live:
        performers, settings, common = _as_live(take, progress)
    else:
        performers, common = _plain(take, settings, progress, show, processes)
    seconds = time.perf_counter() - began
    frames = sum(one.poses.frame_count for one in performers.values())
    metrics: SolveMetrics = {
        "frames": frames,
        "as_live": as_live,
        "solve_s": round(seconds, 3),
        "ms_per_frame": round(seconds * 1e3 / max(frames, 1), 4),
        "frames_per_second": round(frames / seconds, 1),
        **common,
    }
    if len(performers) == 1:
        (only,) = performers.values()
        metrics |= only.metrics
        performers = {"": replace(only, metrics=metrics)}
    else:
        metrics["performers"] = {performer: one.metrics for performer, one in performers.items()}
    return write_performers(
        take, name, settings=settings, performers=performers, metrics=metrics, to_disk=to_disk
    )


def _plain(
    take: Take,
    settings: SolveSettings,
    progress: Progress | None,
    show: Show | None,
    processes: int | None,
) -> tuple[dict[str, Solved], SolveMetrics]:
    """Return what is solved of each performer, and the figures of all."""
    check_together(settings)
    calibration, common = take.calibration(), SolveMetrics()
    if is_tracked(take, settings):
        frames, calibration, settings, told = tracked_frames(
            take, calibration, settings, progress, show=show, processes=processes
        )
        common |= told
    else:
        frames = camera_frames(take.raw_path)
    used = {
        name: frames[name] for name in settings.camera_names(tuple(calibration.cameras)) if name in frames
    }
    if not several_bodies(used):
        return {PERFORMER: _performer(take, used, calibration, settings, progress)}, common
    found = find_people(used, calibration, known_people(take))
    people, made = exchanged(found, calibration, exchanges_of(take.meta))
    common["exchanges"] = [exchange_json(one) for one in made]
    common["bystanders"] = people.bystanders
    common["recorded_s"] = [list(span) for span in people.recorded_s]
    solved: dict[str, Solved] = {}
    for done, one in enumerate(people.performers):
        part = part_of_progress(progress, done / len(people.performers), (done + 1) / len(people.performers))
        own = _performer(take, one.frames, one.calibration, settings, part)
        own.metrics["undecided_s"] = [list(span) for span in one.undecided_s]
        solved[one.name] = own
    common["camera_frames"] = sum(len(mine) for mine in used.values())
    return solved, common


def _performer(
    take: Take,
    frames: Mapping[str, Sequence[CameraFrame]],
    calibration: Calibration,
    settings: SolveSettings,
    progress: Progress | None,
) -> Solved:
    """Return the solve of one performer; `frames` by camera show nobody else."""
    residuals, trace, physics = SolveResiduals(), TraceCollector(), SolveMetrics()
    calibration = with_performer(calibration, frames)
    if calibration.performer is None:
        raise CalibrationError(
            "calibration.no_performer",
            "the calibration of {take} has no performer and the frames show none; run `studio "
            "calibrate {take}`",
            take=take.path,
        )
    found = disagreements(calibration, frames, from_s=take.meta["calibration_s"])
    every = Joined(list(without_named(calibration, frames, found).values()))
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
    metrics: SolveMetrics = {
        "frames": poses.frame_count,
        "camera_frames": len(every),
        **residuals.figures(),
        **agreement_figures(found, float(poses.time_s[0])),
        **physics,
    }
    return Solved(poses, metrics, trace.trace())


def _as_live(take: Take, progress: Progress | None) -> tuple[dict[str, Solved], SolveSettings, SolveMetrics]:
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
    performers: dict[int, _AsLive] = {}
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
            for one in () if result is None else result.each():
                performers.setdefault(one.performer, _AsLive()).add(one)
    if progress is not None:
        progress(1.0)
    if pipeline.settings is None:
        raise TakeError(
            "take.log_no_beginning",
            "the live log of {path} has no beginning; run `studio doctor`",
            path=take.path,
        )
    solved = {f"performer_{number}": one.solved() for number, one in sorted(performers.items())}
    common: SolveMetrics = {"camera_frames": done}
    return solved or {PERFORMER: _AsLive().solved()}, pipeline.settings, common


class _AsLive:
    """What the live stage made of one performer."""

    def __init__(self) -> None:
        self._results: list[StepResult] = []
        self._residuals, self._trace = SolveResiduals(), TraceCollector()

    def add(self, result: StepResult) -> None:
        self._results.append(result)
        self._residuals.add(result)
        self._trace.add(result)

    def solved(self) -> Solved:
        undecided = [result.frame_set.stage_time_ns * 1e-9 for result in self._results if result.undecided]
        metrics = self._residuals.figures()
        if undecided:
            metrics["undecided_s"] = [list(span) for span in spans(undecided, 1)]
        return Solved(collect_poses(self._results), metrics, self._trace.trace())
