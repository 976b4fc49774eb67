"""A performer who squats, bends and claps, feet flat on one place: every angle is known."""

import numpy as np

from studio.engine.model.joints import OUTPUT_INDEX
from studio.engine.model.poses import Poses
from tests.poses_factory import make_poses


def squatting(frames: int = 61, lift_m: float = 0.0) -> Poses:
    """Return two squats in which the elbows bend and the hands meet in front; the feet stand `lift_m` too high."""
    t = np.linspace(0.0, 1.0, frames)
    knee, elbow, forward = 0.6 - 0.55 * np.cos(4 * np.pi * t), 0.1 + 0.9 * t, 1.5 * t
    local = np.zeros((frames, 52, 4))
    local[..., 0] = 1.0
    for side, sign in (("Left", 1.0), ("Right", -1.0)):
        _turn(local, f"{side}UpLeg", -0.5 * knee, 1)
        _turn(local, f"{side}Leg", knee, 1)
        _turn(local, f"{side}Foot", -0.5 * knee, 1)
        _turn(local, f"{side}Arm", -sign * forward, 3)
        _turn(local, f"{side}ForeArm", -sign * elbow, 3)
    still = make_poses(local, root_m=np.zeros((frames, 3)))
    ankle, rest = OUTPUT_INDEX["LeftFoot"], make_poses(local[:1] * 0 + [1, 0, 0, 0])
    root = rest.positions_m[0, ankle] - still.positions_m[:, ankle]
    toe = rest.positions_m[0, OUTPUT_INDEX["LeftToeBase"], 2]
    return make_poses(local, root_m=root + np.array([0.0, 0.0, 0.02 - toe + lift_m]))


def _turn(local: np.ndarray, joint: str, angle: np.ndarray, axis: int) -> None:
    local[:, OUTPUT_INDEX[joint], 0] = np.cos(angle / 2)
    local[:, OUTPUT_INDEX[joint], axis] = np.sin(angle / 2)
