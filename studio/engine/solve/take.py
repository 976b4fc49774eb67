"""A whole take through the pipeline: all frames, final clocks, and finishing where it is on."""

from collections.abc import Callable, Iterable
from typing import Any

import numpy as np

from studio.engine.calibration.result import Calibration
from studio.engine.errors import SettingsError, TakeError
from studio.engine.finish.finisher import Finisher
from studio.engine.frames import CameraFrame, StepResult
from studio.engine.joints import OUTPUT_JOINTS, OUTPUT_PARENTS
from studio.engine.pipeline import Pipeline
from studio.engine.poses import Poses
from studio.engine.schedule import Schedule
from studio.engine.settings import SolveSettings
from studio.engine.solve.following import Following

ProgressCallback = Callable[[float], None]
"""Called with the share done, 0..1."""


def collect_poses(results: list[StepResult]) -> Poses:
    """Return steps' results, in time order, as `Poses`.

    Raises:
        TakeError: there is none.
    """
    if not results:
        raise TakeError(
            "no camera shows the performer in this take; check the cameras and `--set cameras=...`"
        )
    return Poses(
        time_s=np.array([r.frame_set.stage_time_ns for r in results]) * 1e-9,
        joint_names=OUTPUT_JOINTS,
        parents=OUTPUT_PARENTS.copy(),
        positions_m=np.array([r.positions_m for r in results]),
        rotations_wxyz=np.array([r.rotations_wxyz for r in results]),
        confidence=np.array([r.confidence for r in results]),
        uncertainty_mm=np.array([r.uncertainty_mm for r in results]),
    )


def solve_frames(
    frames: Iterable[CameraFrame],
    calibration: Calibration,
    settings: SolveSettings,
    *,
    start_s: float | None = None,
    progress: ProgressCallback | None = None,
    following: Following | None = None,
    physics: dict[str, Any] | None = None,
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
        physics: receives what `physics=on` gained; see `physics.report`.

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
    results: list[StepResult] = []
    for done, (_, frame) in enumerate(placed):
        pipeline.add_frame(frame)
        for stage_ns in schedule.due(pipeline.newest_stage_ns()):
            result = pipeline.step(stage_ns)
            if result is not None and (start_s is None or stage_ns >= start_s * 1e9):
                results.append(result) if finisher is None else finisher.add(result)
        if progress is not None and done % 64 == 0:
            progress(done / len(placed))
    if finisher is not None:
        results.extend(finisher.results())
        if physics is not None:
            physics.update(finisher.physics_report)
    if following is not None:
        for result in results:
            following.add(result)
    if progress is not None:
        progress(1.0)
    return collect_poses(results)


def _finisher(calibration: Calibration, settings: SolveSettings) -> Finisher | None:
    if settings.physics == "on" and settings.finish == "off":
        raise SettingsError("physics=on corrects a finished take; set finish=on too, or take preset finish")
    if settings.finish == "off" or calibration.performer is None:
        return None
    return Finisher(calibration.performer, settings)
