"""The solve of a whole take: all frames through the pipeline with final clocks, then finishing if set."""

from collections.abc import Callable, Iterable, Sequence

import numpy as np
from numpy.typing import NDArray

from studio.engine.base.errors import SettingsError
from studio.engine.model.calibration import Calibration
from studio.engine.model.frames import CameraFrame, StepResult
from studio.engine.model.on_demand import FramesOnDemand
from studio.engine.model.poses import Poses
from studio.engine.model.settings import SolveSettings
from studio.engine.model.solve_metrics import SolveMetrics
from studio.engine.solve.stream import Stream
from studio.engine.whole_take.collect import PoseCollector
from studio.engine.whole_take.cut import LOOKED_S, cut_between_s, parts_between_cuts
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
) -> Poses:
    """Return the poses of a take's frames.

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

    Raises:
        TakeError: there is no frame, or no camera shows the performer.
        CalibrationError, SettingsError: see `Pipeline`.
    """
    if not isinstance(frames, Sequence):
        frames = list(frames)
    placed, start_ns = _order(frames, calibration, start_s)
    parts = _parts(frames, placed)
    collector = PoseCollector()

    def collect(result: StepResult) -> None:
        collector.add(result)
        if residuals is not None:
            residuals.add(result)
        if trace is not None:
            trace.add(result)

    finisher = _finisher(calibration, settings)
    live_share = 1.0 if finisher is None else LIVE_SHARE

    def take(results: list[StepResult]) -> None:
        for result in results:
            if result.frame_set.stage_time_ns >= start_ns:
                collect(result) if finisher is None else finisher.add(result)

    done = 0
    for part in range(int(parts.max(initial=0)) + 1):
        stream = Stream(calibration, settings)
        if finisher is not None:
            finisher.cut()
        for place in placed["place"][parts == part].tolist():
            take(stream.add(frames[place]))
            if progress is not None and done % 64 == 0:
                progress(live_share * (done + 1) / len(placed))
            done += 1
        take(stream.rest())
    if finisher is not None:
        for result in finisher.results(part_of_progress(progress, live_share, 1.0) or _to_nobody):
            collect(result)
        if physics is not None:
            physics.update(finisher.physics_report)
    if progress is not None:
        progress(1.0)
    return collector.poses()


def _to_nobody(share: float) -> None:
    """Receive progress that nobody asked for."""


def part_of_progress(progress: ProgressCallback | None, begin: float, end: float) -> ProgressCallback | None:
    """Return what is told the share of a part of the work that goes from `begin` to `end`."""
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
    """Return the frames to use by stage time, then camera, then number, `place` being their index; and when poses
    begin [ns]."""
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


def _finisher(calibration: Calibration, settings: SolveSettings) -> Finisher | None:
    check_together(settings)
    if settings.finish == "off" or calibration.performer is None:
        return None
    return Finisher(calibration.performer, settings, floor_given=calibration.floor_given)
