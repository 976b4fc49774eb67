"""The solve of a whole take: all frames through the pipeline with final clocks, then finishing if set."""

from collections.abc import Callable, Iterable, Sequence

import numpy as np
from numpy.typing import NDArray

from studio.engine.base.errors import SettingsError
from studio.engine.edits.pins import Pins
from studio.engine.model.calibration import Calibration
from studio.engine.model.frames import CameraFrame, StepResult
from studio.engine.model.human.skeleton import Skeleton
from studio.engine.model.on_demand import FramesOnDemand
from studio.engine.model.poses import Poses
from studio.engine.model.settings.settings import SolveSettings
from studio.engine.model.solve_metrics import SolveMetrics
from studio.engine.solve.stream import Stream
from studio.engine.whole_take.collect import PoseCollector
from studio.engine.whole_take.cut import LOOKED_S, cut_between_s, parts_between_cuts
from studio.engine.whole_take.edited import AROUND_S, Edited, going_back
from studio.engine.whole_take.finisher import Finisher
from studio.engine.whole_take.residuals import SolveResiduals
from studio.engine.whole_take.trace import TraceCollector

ProgressCallback = Callable[[float], None]
"""Called with the share done, 0..1."""

LAST_NS = 2**63 - 1
"""Times of a clock that is wrong by centuries are clipped to 64 bits."""

LIVE_SHARE = 0.6
"""The pipeline's share of a solve's time if finishing follows."""


def solve_frames(
    frames: Iterable[CameraFrame],
    calibration: Calibration,
    settings: SolveSettings,
    *,
    start_s: float | None = None,
    progress: ProgressCallback | None = None,
    residuals: SolveResiduals | None = None,
    physics: SolveMetrics | None = None,
    trace: TraceCollector | None = None,
    pins: Pins | None = None,
) -> Poses:
    """Return the poses of a take's frames, of one performer.

    Args:
        frames: of all cameras, in any order; a sequence is read frame by frame, not copied.
        calibration: gives cameras, clocks and performer.
        settings: the switches.
        start_s: frames before this stage time [s] are left out; None = none. No state is kept from before it, because
            a performer may stand elsewhere after the calibration part. Frames just after it that still belong to
            the part before such a cut are left out too.
        progress: receives the share done.
        residuals: counts the joints that the poses do not follow.
        physics: receives the effect of `physics=on`, as in `metrics.json`.
        trace: receives the inputs of each frame.
        pins: places of joints that an operator knows.

    Raises:
        TakeError: there is no frame, or no camera shows the performer.
        CalibrationError, SettingsError: see `Pipeline`.
    """
    solve = TakeSolve(
        frames, calibration, settings,
        start_s=start_s, progress=progress, residuals=residuals, physics=physics, trace=trace, pins=pins,
    )  # fmt: skip
    solve.first()
    return solve.poses()


class TakeSolve:
    """The solve of one performer's take: `first` passes its frames through the pipeline, then `poses` finishes it.

    Attributes:
        finisher: None without finishing.
    """

    def __init__(
        self,
        frames: Iterable[CameraFrame],
        calibration: Calibration,
        settings: SolveSettings,
        *,
        start_s: float | None = None,
        progress: ProgressCallback | None = None,
        residuals: SolveResiduals | None = None,
        physics: SolveMetrics | None = None,
        trace: TraceCollector | None = None,
        pins: Pins | None = None,
        edited: Edited | None = None,
    ) -> None:
        """Prepare; arguments and errors are those of `solve_frames`. `edited`: changes by edits, in some stretches
        only; None = nothing."""
        self._frames = frames if isinstance(frames, Sequence) else list(frames)
        self._calibration, self._settings, self._start_s = calibration, settings, start_s
        self._progress, self._physics = progress, physics
        self._residuals, self._trace, self._pins = residuals, trace, pins
        self._collector = PoseCollector()
        self._last_ns = -LAST_NS
        self._edited = edited
        self._skeleton = None if calibration.performer is None else Skeleton.of(calibration.performer)
        self.finisher = _finisher(calibration, settings, pins, edited)
        self._live_share = 1.0 if self.finisher is None else LIVE_SHARE

    def first(self) -> None:
        """Pass all frames through the pipeline."""
        placed, start_ns = _order(self._frames, self._calibration, self._start_s)
        parts = _parts(self._frames, placed)
        done = 0
        for part in range(int(parts.max(initial=0)) + 1):
            stream = Stream(self._calibration, self._settings, pins=self._pins)
            if self.finisher is not None:
                self.finisher.cut()
            both = _BothWays(stream, self._edited)
            for place, stage_ns in placed[["place", "stage_ns"]][parts == part].tolist():
                self._take(both.add(self._frames[place], place, stage_ns), start_ns)
                if self._progress is not None and done % 64 == 0:
                    self._progress(self._live_share * (done + 1) / len(placed))
                done += 1
            self._take(both.rest(), start_ns)

    def poses(self) -> Poses:
        """Return the poses, finished where the settings say so."""
        if self.finisher is not None:
            for result in self.finisher.results(self.finishing_progress()):
                self._collect(result)
            if self._physics is not None:
                self._physics.update(self.finisher.physics_report)
        if self._progress is not None:
            self._progress(1.0)
        return self._collector.poses()

    def finishing_progress(self) -> ProgressCallback:
        """Return the callback that receives the share of finishing that is done."""
        return part_of_progress(self._progress, self._live_share, 1.0) or _to_nobody

    def _take(self, results: list[tuple[StepResult, StepResult | None]], start_ns: float) -> None:
        for result, edited in results:
            stage_ns = result.frame_set.stage_time_ns
            if (
                stage_ns >= start_ns and stage_ns > self._last_ns
            ):  # a part may begin with the last frame of the one before
                self._last_ns = stage_ns
                self._add(result, edited)

    def _add(self, result: StepResult, edited: StepResult | None) -> None:
        if self.finisher is not None:
            self.finisher.add(result)
            if edited is not None:
                self.finisher.add_edited(edited)
            return
        if edited is not None and self._edited is not None:
            assert self._skeleton is not None
            span = self._edited.span_at(1e-9 * result.frame_set.stage_time_ns)
            result = result if span is None else going_back(result, edited, span, self._skeleton)
        self._collect(result)

    def _collect(self, result: StepResult) -> None:
        self._collector.add(result)
        if self._residuals is not None:
            self._residuals.add(result)
        if self._trace is not None:
            self._trace.add(result)


class _BothWays:
    """Solves a part of a take without edits and, where they change it, also with them."""

    def __init__(self, stream: Stream, edited: Edited | None) -> None:
        self._stream, self._edited = stream, edited
        self._other: Stream | None = None
        self._span = -np.inf, -np.inf

    def add(
        self, frame: CameraFrame, place: int, stage_ns: int
    ) -> list[tuple[StepResult, StepResult | None]]:
        """Add a frame, by its place among all; return the steps that are due, each with its version with edits."""
        edited = self._edited
        if edited is None:
            return [(result, None) for result in self._stream.add(frame)]
        span = edited.span_at(1e-9 * stage_ns)
        if span is not None:
            self._span = span
            self._other = self._other or self._stream.with_pins(edited.pins)
        return self._paired(
            self._stream.add(frame), self._other.add(edited.frames[place]) if self._other else []
        )

    def rest(self) -> list[tuple[StepResult, StepResult | None]]:
        """Return the remaining steps."""
        return self._paired(self._stream.rest(), self._other.rest() if self._other else [])

    def _paired(
        self, results: list[StepResult], others: list[StepResult]
    ) -> list[tuple[StepResult, StepResult | None]]:
        at = {other.frame_set.stage_time_ns: other for other in others}
        if results and 1e-9 * results[-1].frame_set.stage_time_ns > self._span[1] + AROUND_S:
            self._other = None
        return [(result, at.get(result.frame_set.stage_time_ns)) for result in results]


def _to_nobody(share: float) -> None:
    """Ignore progress."""


def part_of_progress(progress: ProgressCallback | None, begin: float, end: float) -> ProgressCallback | None:
    """Return the callback for the progress of a part of the work, from share `begin` to share `end` of the whole."""
    return None if progress is None else lambda share: progress(begin + (end - begin) * share)


def _parts(frames: Sequence[CameraFrame], placed: NDArray[np.void]) -> NDArray[np.int64]:
    """Return the part between cuts that each placed frame belongs to, shape (frame_count,)."""
    rows = {camera: np.flatnonzero(placed["camera"] == camera) for camera in np.unique(placed["camera"])}
    chosen = {str(camera): _OfOneCamera(frames, placed["place"][own]) for camera, own in rows.items()}
    times_s = {str(camera): placed["stage_ns"][own] * 1e-9 for camera, own in rows.items()}
    parts = np.zeros(len(placed), dtype=np.int64)
    found = parts_between_cuts(chosen, times_s)
    for camera, own in rows.items():
        parts[own] = found[str(camera)]
    return parts


class _OfOneCamera(FramesOnDemand):
    """One camera's frames, by their places among all."""

    def __init__(self, frames: Sequence[CameraFrame], places: NDArray[np.int64]) -> None:
        self._frames, self._places = frames, places

    def __len__(self) -> int:
        return len(self._places)

    def at(self, index: int) -> CameraFrame:
        return self._frames[int(self._places[index])]


def _order(
    frames: Sequence[CameraFrame], calibration: Calibration, start_s: float | None
) -> tuple[NDArray[np.void], float]:
    """Return the frames to use, sorted by stage time, then camera, then number, `place` being their index; and the
    time of the first pose [ns]."""
    clocks = {name: camera.clock for name, camera in calibration.cameras.items()}
    ranks = {name: rank for rank, name in enumerate(sorted(clocks))}
    keys = (
        (
            min(clocks[frame.camera].stage_ns(frame.device_time_ns), LAST_NS),
            ranks[frame.camera],
            frame.sequence,
            place,
        )
        for place, frame in enumerate(frames)
        if frame.camera in clocks
    )
    placed = np.fromiter(
        keys, np.dtype([(key, np.int64) for key in ("stage_ns", "camera", "sequence", "place")])
    )
    placed = placed[np.lexsort((placed["sequence"], placed["camera"], placed["stage_ns"]))]
    if start_s is None:
        return placed, -np.inf
    start_ns = start_s * 1e9
    placed = placed[placed["stage_ns"] >= start_ns]
    cuts = []
    for camera in np.unique(placed["camera"]):
        own = placed[(placed["camera"] == camera) & (placed["stage_ns"] < (start_s + LOOKED_S) * 1e9)]
        times_s = own["stage_ns"] * 1e-9 - start_s
        cuts.append(cut_between_s([frames[place] for place in own["place"]], times_s))
    found = np.array([cut for cut in cuts if cut is not None])
    if len(found):
        placed = placed[placed["stage_ns"] > (start_s + found[:, 0].max() + 1e-6) * 1e9]
        start_ns = (start_s + found[:, 1].min()) * 1e9
    return placed, start_ns


def check_together(settings: SolveSettings) -> None:
    """Raise SettingsError for a combination of switches that does not work for a whole take."""
    if settings.physics == "on" and settings.finish == "off":
        raise SettingsError(
            "settings.physics_needs_finish",
            "physics=on corrects a finished take; set finish=on too, or take preset finish",
        )


def _finisher(
    calibration: Calibration, settings: SolveSettings, pins: Pins | None, edited: Edited | None
) -> Finisher | None:
    check_together(settings)
    if settings.finish == "off" or calibration.performer is None:
        return None
    return Finisher(
        calibration.performer, settings, floor_given=calibration.floor_given, pins=pins, edited=edited
    )
