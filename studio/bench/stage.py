"""The input of the benchmark: two cameras that watch the embedded performer, as bytes on the wire."""

from dataclasses import dataclass

import numpy as np

from studio import wire
from studio.engine.calibration.result import Calibration, CameraCalibration, Performer
from studio.engine.geometry import invert_transform, make_transform, transform_points
from studio.engine.motion.authored import demo_motion

CAMERA_HZ = 30
JOINT_SET = "canonical"
START_S = 3.0
"""Where in the performance the benchmark begins: after the T-pose."""


@dataclass(frozen=True)
class Stage:
    """A calibrated stage and its cameras' messages, (name, bytes of a `SkeletonFrame`), in time order."""

    calibration: Calibration
    messages: list[tuple[str, bytes]]


def make_stage(seconds: float) -> Stage:
    """Return a stage of two cameras, 35 degrees to either side and 3.5 m away, with 1 cm of noise."""
    rng = np.random.default_rng(1)
    motion = demo_motion()
    height = float(motion.positions_m[0, :, 2].max()) + 0.12
    cameras = {f"camera_{k}": CameraCalibration(_place(side)) for k, side in enumerate((-35.0, 35.0))}
    calibration = Calibration("camera_0", cameras, Performer(height, motion.offsets_m))
    hands = [wire.HandState(side, "shape", 0.8) for side in ("left", "right")]
    messages: list[tuple[str, bytes]] = []
    for k in range(round(seconds * CAMERA_HZ)):
        for i, (name, camera) in enumerate(cameras.items()):
            time_s = k / CAMERA_HZ + i * 0.011
            joints = motion.at((START_S + time_s) % motion.duration_s) + rng.normal(0, 0.01, (21, 3))
            seen = transform_points(invert_transform(camera.T_stage_camera), joints)
            frame = wire.skeleton_frame(k, round(time_s * 1e9), seen, np.full(len(seen), 0.9), hands)
            messages.append((name, wire.encode(frame)))
    return Stage(calibration, messages)


def _place(side_deg: float) -> np.ndarray:
    """T_stage_camera of a camera at 3.5 m and 1.2 m high that looks at the middle of the stage."""
    angle = np.radians(side_deg)
    place = np.array([3.5 * np.sin(angle), -3.5 * np.cos(angle), 1.2])
    forward = np.array([0.0, 0.0, 1.0]) - place
    forward /= np.linalg.norm(forward)
    right = np.cross(forward, [0.0, 0.0, 1.0])
    right /= np.linalg.norm(right)
    return make_transform(np.stack([right, np.cross(forward, right), forward], axis=1), place)
