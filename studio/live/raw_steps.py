"""What the cameras see while the solver is being prepared: steps without a body, so that the view is never empty."""

from collections.abc import Mapping

import numpy as np

from studio.engine.base.geometry import transform_points
from studio.engine.model.calibration import Calibration
from studio.engine.model.frames import FrameSet, FusedSkeleton, StepResult
from studio.engine.model.joints import JOINT_COUNT, OUTPUT_JOINTS
from studio.engine.model.triangulation.guess import camera_joints
from studio.live.cameras.roster import Roster

_PERIOD_NS = 33_000_000
_RECENT_NS = 300_000_000
"""An older frame of a camera is not shown."""


class RawSteps:
    """Makes at most 30 steps a second from the cameras' newest frames."""

    def __init__(self) -> None:
        self._last_ns: int | None = None

    def step(self, calibration: Calibration, roster: Roster, now_ns: int) -> StepResult | None:
        """Return the newest skeletons of the calibrated cameras; None if none is new enough, or a step is not due.

        Args:
            calibration: places the cameras.
            roster: the cameras and their clocks.
            now_ns: time of the server's clock [ns].
        """
        if self._last_ns is not None and now_ns - self._last_ns < _PERIOD_NS:
            return None
        now = roster.clock.server_to_stage_ns(now_ns)
        if now is None:
            return None
        times: dict[str, int] = {}
        seen: dict[str, np.ndarray] = {}
        for camera in roster.connected():
            if camera.name in calibration.cameras and camera.recent:
                frame = camera.recent[-1]
                time_ns = roster.clock_of(camera.name).stage_ns(frame.device_time_ns)
                if now - time_ns < _RECENT_NS:
                    T_stage_camera = calibration.cameras[camera.name].T_stage_camera
                    times[camera.name] = time_ns
                    seen[camera.name] = transform_points(T_stage_camera, camera_joints(frame))
        if not seen:
            return None
        self._last_ns = now_ns
        return without_body(max(times.values()), seen)


def without_body(stage_time_ns: int, seen: Mapping[str, np.ndarray]) -> StepResult:
    """Return a step with the cameras' skeletons on the stage, each of the shape (21, 3) [m], and no body."""
    count, joints = len(seen), len(OUTPUT_JOINTS)
    unknown = np.full(JOINT_COUNT, np.nan)
    frame_set = FrameSet(
        stage_time_ns,
        tuple(seen),
        np.stack(list(seen.values())),
        np.ones((count, JOINT_COUNT)),
        np.zeros((0, 3)),
    )
    fused = FusedSkeleton(
        np.full((JOINT_COUNT, 3), np.nan), np.zeros(JOINT_COUNT), unknown, np.ones((count, JOINT_COUNT), bool)
    )
    return StepResult(
        frame_set,
        fused,
        positions_m=np.full((joints, 3), np.nan),
        rotations_wxyz=np.tile([1.0, 0.0, 0.0, 0.0], (joints, 1)),
        confidence=np.zeros(joints),
        uncertainty_mm=np.full(joints, np.nan),
    )
