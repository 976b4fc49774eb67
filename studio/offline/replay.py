"""Replay: a take's raw frames through the pipeline again, with any settings or exactly as live."""

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from studio.engine.base.errors import CalibrationError, TakeError
from studio.engine.base.sentences import Said
from studio.engine.calibration.calibrate import with_performer
from studio.engine.calibration.quality.agreement import agreement_figures, disagreements, without_named
from studio.engine.edits.edit import Edit
from studio.engine.identity.recognised import performer_key
from studio.engine.identity.undecided import spans
from studio.engine.model.calibration import Calibration
from studio.engine.model.frames import CameraFrame, StepResult
from studio.engine.model.poses import Poses
from studio.engine.model.settings.settings import SolveSettings
from studio.engine.model.solve_metrics import SolveMetrics
from studio.engine.whole_take.collect import collect_poses
from studio.engine.whole_take.edited import edited_of
from studio.engine.whole_take.mending.floor import lift_of_pins_m
from studio.engine.whole_take.mending.frames import edited_frames
from studio.engine.whole_take.residuals import SolveResiduals
from studio.engine.whole_take.take import TakeSolve, check_together
from studio.engine.whole_take.together import solve_together
from studio.engine.whole_take.trace import TraceCollector
from studio.offline.editing import AskedEdits
from studio.offline.performers import people_of, without_depth
from studio.offline.so_far import Show
from studio.offline.tracking import is_tracked, tracked_frames
from studio.take.edits.carry import EditsOfSolve, edits_of_solve
from studio.take.folder.performers import exchange_json
from studio.take.folder.solves import Solved, write_performers
from studio.take.folder.take import PERFORMER, Take
from studio.take.library.live_solve import recorded_spans
from studio.take.raw.frames import RawEvent, RawFrame, camera_frames, inspect_raw, read_raw
from studio.take.raw.kept_frames import Joined, several_bodies
from studio.take.raw.live_log import LoggedPipeline
from studio.take.rigid_bodies.used import pins_of

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
    edits: Sequence[Edit] | None = None,
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
        show: receives the solve so far, where it tracks depth first.
        processes: maximum number that track cameras in parallel; see `track_cameras`.
        edits: of the take; those that are on are honoured, and `edits` in metrics.json has the outcome of each.
            None = those that the take has. Not with `as_live`.

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
        kept = edits_of_solve(take) if edits is None else EditsOfSolve(tuple(edits), None)
        asked = AskedEdits(tuple(edit for edit in kept.edits if edit.on))
        performers, common = _plain(take, settings, progress, show, processes, asked)
        common |= _of_edits(kept)
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
    asked: AskedEdits,
) -> tuple[dict[str, Solved], SolveMetrics]:
    """Return the solve of each performer, and the figures of all."""
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
    pictures = without_depth(used, calibration)
    if pictures and several_bodies(used):
        common["people"] = _of_pictures(pictures, alone=len(pictures) == len(used))
    found = people_of(take, used, calibration, everybody=settings.everybody)
    if found is None:
        settings.check_performers([PERFORMER])
        mine = asked.of(PERFORMER, used, calibration)
        only = _PerformerSolve(
            take, used, calibration, settings.of_performer(PERFORMER), progress, asked, mine, PERFORMER
        )
        poses = solve_together({PERFORMER: only.solve})
        solved = {PERFORMER: only.solved(poses[PERFORMER])}
        return asked.applied(solved, used, common)
    people = found.people
    common["exchanges"] = [exchange_json(one) for one in found.exchanges]
    common["bystanders"] = people.bystanders
    if people.left_out:
        common["left_out"] = people.left_out
    common["recorded_s"] = [list(span) for span in people.recorded_s]
    settings.check_performers([one.name for one in people.performers])
    shares = _Shares(progress, len(people.performers))
    solves = [
        _PerformerSolve(
            take,
            one.frames,
            one.calibration,
            settings.of_performer(one.name),
            shares.part(k),
            asked,
            asked.of(one.name, one.frames, one.calibration),
            one.name,
        )
        for k, one in enumerate(people.performers)
    ]
    solved: dict[str, Solved] = {}
    names = [one.name for one in people.performers]
    poses = solve_together({name: solve.solve for name, solve in zip(names, solves, strict=True)})
    for one, solve in zip(people.performers, solves, strict=True):
        solved[one.name] = solve.solved(poses[one.name])
        solved[one.name].metrics["undecided_s"] = [list(span) for span in one.undecided_s]
    common["camera_frames"] = sum(len(used[name]) for name in found.cameras)
    return asked.applied(solved, used, common)


def solved_with(take: Take, settings: SolveSettings, edits: Sequence[Edit]) -> dict[str, Solved]:
    """Return the solve of each performer with some edits, which are all on; nothing is written.

    Raises:
        TakeError, CalibrationError, SettingsError: as `solve_take`.
    """
    solved, _ = _plain(take, settings, None, None, None, AskedEdits(tuple(edits)))
    return solved


def _of_edits(kept: EditsOfSolve) -> SolveMetrics:
    """Return which list of edits a solve had, and why it did not use it; nothing without a list."""
    said = SolveMetrics()
    if kept.revision is not None:
        said["edits_revision"] = kept.revision
    if kept.says:
        said["edits_said"] = str(kept.says)
        said["said"] = [kept.says.to_json()] if isinstance(kept.says, Said) else []
    return said


def _of_pictures(cameras: list[str], *, alone: bool) -> str:
    """Return what becomes of cameras without depth where several bodies are seen, one line."""
    what = "the first body of each picture is followed" if alone else "they are left out"
    return f"cameras without depth ({', '.join(cameras)}) do not tell performers apart: {what}"


class _Shares:
    """Progress of several performers' solves, which advance in turns."""

    def __init__(self, progress: Progress | None, count: int) -> None:
        self._progress, self._shares = progress, [0.0] * count

    def part(self, index: int) -> Progress | None:
        """Return the function that receives one performer's share."""
        return None if self._progress is None else lambda share: self._tell(index, share)

    def _tell(self, index: int, share: float) -> None:
        assert self._progress is not None
        self._shares[index] = share
        self._progress(sum(self._shares) / len(self._shares))


class _PerformerSolve:
    """The solve of one performer, and its measurements."""

    def __init__(
        self,
        take: Take,
        frames: Mapping[str, Sequence[CameraFrame]],
        calibration: Calibration,
        settings: SolveSettings,
        progress: Progress | None,
        asked: AskedEdits,
        edits: Sequence[Edit],
        performer: str,
    ) -> None:
        """Prepare; `frames` by camera show nobody else, and `edits` are those of `asked` that can be honoured."""
        self._residuals, self._trace, self._physics = SolveResiduals(), TraceCollector(), SolveMetrics()
        calibration = _with_proportions(take, calibration, frames)
        self._found = disagreements(calibration, frames, from_s=take.meta["calibration_s"])
        agreeing = without_named(calibration, frames, self._found)
        start_s = take.meta["calibration_s"]
        lifted_m = lift_of_pins_m(agreeing, calibration, settings, edits, start_s=start_s)
        frames = edited_frames(agreeing, calibration, edits, lifted_m=lifted_m, tell=asked.mended.append)
        pins = pins_of(take, performer, edits, calibration.performer)
        edited = edited_of(agreeing, frames, edits, pins, calibration, start_s)
        if edited is not None:
            edited = replace(edited, frames=Joined(list(frames.values())))
            frames, pins = agreeing, pins_of(take, performer, (), calibration.performer)
        self._every = Joined(list(frames.values()))
        self.solve = TakeSolve(
            self._every,
            calibration,
            settings,
            start_s=start_s,
            progress=progress,
            residuals=self._residuals,
            physics=self._physics,
            trace=self._trace,
            pins=pins,
            edited=edited,
        )

    def solved(self, poses: Poses) -> Solved:
        """Return the solve of these poses, with its figures."""
        metrics: SolveMetrics = {
            "frames": poses.frame_count,
            "camera_frames": len(self._every),
            **self._residuals.figures(),
            **agreement_figures(self._found, float(poses.time_s[0])),
            **self._physics,
        }
        return Solved(poses, metrics, self._trace.trace())


def _with_proportions(
    take: Take, calibration: Calibration, frames: Mapping[str, Sequence[CameraFrame]]
) -> Calibration:
    """Return the calibration with the proportions of the performer whom the frames show.

    Raises:
        CalibrationError: it has none, and they show too little.
    """
    calibration = with_performer(calibration, frames)
    if calibration.performer is None:
        raise CalibrationError(
            "calibration.no_performer",
            "the calibration of {take} has no performer and the frames show none; run `studio "
            "calibrate {take}`",
            take=take.path,
        )
    return calibration


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
    solved = {performer_key(number): one.solved() for number, one in sorted(performers.items())}
    common: SolveMetrics = {"camera_frames": done}
    if len(solved) > 1:
        common["recorded_s"] = recorded_spans([one.poses for one in solved.values()])
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
