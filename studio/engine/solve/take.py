"""A whole take through the pipeline: all frames, final clocks, and finishing where it is on."""

from collections.abc import Callable, Iterable
from typing import Any

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
        frames: of all cameras, in any order.
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
    clocks = {name: camera.clock for name, camera in calibration.cameras.items()}
    placed = [(clocks[f.camera].stage_ns(f.device_time_ns), f) for f in frames if f.camera in clocks]
    placed.sort(key=lambda item: (item[0], item[1].camera, item[1].sequence))
    if start_s is not None:
        placed = [item for item in placed if item[0] >= start_s * 1e9]
    pipeline, schedule = Pipeline(calibration, settings), Schedule(settings.output_hz)
    finisher = _finisher(calibration, settings)
    collector = PoseCollector()

    def collect(result: StepResult) -> None:
        collector.add(result)
        if following is not None:
            following.add(result)
        if trace is not None:
            trace.add(result)

    total, live_share = max(len(placed), 1), 1.0 if finisher is None else LIVE_SHARE
    placed.reverse()
    while placed:  # a frame that is done with is let go
        pipeline.add_frame(placed.pop()[1])
        for stage_ns in schedule.due(pipeline.newest_stage_ns()):
            result = pipeline.step(stage_ns)
            if result is not None and (start_s is None or stage_ns >= start_s * 1e9):
                collect(result) if finisher is None else finisher.add(result)
        done = total - len(placed)
        if progress is not None and done % 64 == 1:
            progress(live_share * done / total)
    if finisher is not None:
        for result in finisher.results():
            collect(result)
        if physics is not None:
            physics.update(finisher.physics_report)
    if progress is not None:
        progress(1.0)
    return collector.poses()


def check_together(settings: SolveSettings) -> None:
    """Raise SettingsError where switches of a whole take do not go together."""
    if settings.physics == "on" and settings.finish == "off":
        raise SettingsError("physics=on corrects a finished take; set finish=on too, or take preset finish")


def _finisher(calibration: Calibration, settings: SolveSettings) -> Finisher | None:
    check_together(settings)
    if settings.finish == "off" or calibration.performer is None:
        return None
    return Finisher(calibration.performer, settings)
