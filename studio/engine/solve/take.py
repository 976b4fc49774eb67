"""A whole take through the pipeline: all frames, final clocks, and finishing where it is on."""

from collections.abc import Callable, Iterable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from studio.engine.calibration.result import Calibration
from studio.engine.errors import SettingsError
from studio.engine.finish.finisher import Finisher
from studio.engine.frames import CameraFrame, StepResult
from studio.engine.pipeline import Pipeline
from studio.engine.poses import Poses
from studio.engine.schedule import Schedule
from studio.engine.settings import SolveSettings
from studio.engine.solve.collect import PoseCollector
from studio.engine.solve.following import Following
from studio.engine.solve.trace import TraceCollector

ProgressCallback = Callable[[float], None]
"""Called with the share done, 0..1."""

LAST_NS = 2**63 - 1
"""A clock that is wrong by centuries is brought within 64 bits."""

LIVE_SHARE = 0.6
"""Share of a solve's time that the pipeline takes where finishing follows."""


def solve_frames(
    frames: Iterable[CameraFrame],
    calibration: Calibration,
    settings: SolveSettings,
    *,
    start_s: float | None = None,
    progress: ProgressCallback | None = None,
    following: Following | None = None,
    physics: dict[str, Any] | None = None,
    trace: TraceCollector | None = None,
) -> Poses:
    """Return the poses of a take's frames.

    Args:
        frames: of all cameras, in any order; a sequence is asked for one after the other, not copied.
        calibration: gives cameras, clocks and performer.
        settings: the switches.
        start_s: frames before this stage time [s] are left out; None = none are. Nothing is carried over from
            before it: a performer may stand elsewhere after the calibration part.
        progress: told the share done.
        following: counts what the poses do not follow.
        physics: receives what `physics=on` gained, as `metrics.json` holds it.
        trace: takes in what each frame was made of.

    Raises:
        TakeError: no frame, or no camera that shows the performer. CalibrationError, SettingsError: see `Pipeline`.
    """
    if not isinstance(frames, Sequence):
        frames = list(frames)
    order = _order(frames, calibration, start_s)
    pipeline, schedule = Pipeline(calibration, settings), Schedule.of(settings)
    finisher = _finisher(calibration, settings)
    collector = PoseCollector()

    def collect(result: StepResult) -> None:
        collector.add(result)
        if following is not None:
            following.add(result)
        if trace is not None:
            trace.add(result)

    def step(times_ns: list[int]) -> None:
        for stage_ns in times_ns:
            result = pipeline.step(stage_ns)
            if result is not None and (start_s is None or stage_ns >= start_s * 1e9):
                collect(result) if finisher is None else finisher.add(result)

    live_share = 1.0 if finisher is None else LIVE_SHARE
    for done, place in enumerate(order.tolist()):
        pipeline.add_frame(frames[place])
        step(schedule.due(pipeline.newest_stage_ns()))
        if progress is not None and done % 64 == 0:
            progress(live_share * (done + 1) / len(order))
    step(schedule.rest(pipeline.newest_stage_ns()))
    if finisher is not None:

        def tell(share: float) -> None:
            if progress is not None:
                progress(live_share + (1.0 - live_share) * share)

        for result in finisher.results(tell):
            collect(result)
        if physics is not None:
            physics.update(finisher.physics_report)
    if progress is not None:
        progress(1.0)
    return collector.poses()


def _order(
    frames: Sequence[CameraFrame], calibration: Calibration, start_s: float | None
) -> NDArray[np.int64]:
    """Return the places of the frames to use, by stage time, then camera, then number."""
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
    if start_s is not None:
        placed = placed[placed["stage_ns"] >= start_s * 1e9]
    return placed["place"][np.lexsort((placed["sequence"], placed["camera"], placed["stage_ns"]))]


def check_together(settings: SolveSettings) -> None:
    """Raise SettingsError where switches of a whole take do not go together."""
    if settings.physics == "on" and settings.finish == "off":
        raise SettingsError("physics=on corrects a finished take; set finish=on too, or take preset finish")


def _finisher(calibration: Calibration, settings: SolveSettings) -> Finisher | None:
    check_together(settings)
    if settings.finish == "off" or calibration.performer is None:
        return None
    return Finisher(calibration.performer, settings, floor_given=calibration.floor_given)
