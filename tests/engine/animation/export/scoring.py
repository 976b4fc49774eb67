"""Hard motions to export, and how far a program's reading is from the poses."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from studio.engine.animation.clip.skeleton import to_file_axes
from studio.engine.model.joints import OUTPUT_INDEX
from studio.engine.model.poses import Poses
from tests.engine.animation.export.readers.programs import ReadBack


def _arms_forward(time_s: NDArray[np.float64], vectors: NDArray[np.float64]) -> None:
    """Arms that move about the forward direction, where the usual rotation order (x, y, z) has its gimbal lock."""
    for name, side in (("LeftArm", -1.0), ("RightArm", 1.0)):
        vectors[:, OUTPUT_INDEX[name]] *= 0.3
        vectors[:, OUTPUT_INDEX[name], 2] += side * np.pi / 2


HARD_MOTIONS: dict[str, dict[str, Any]] = {
    "lively": {"angle_sd_rad": 0.3, "cutoff_hz": 2.0},
    "turning": {"angle_sd_rad": 0.3, "cutoff_hz": 2.0, "turns_per_s": 1.5},
    "arms forward": {"angle_sd_rad": 0.3, "cutoff_hz": 2.0, "shape_local": _arms_forward},
    "tumbling": {"angle_sd_rad": 0.8, "cutoff_hz": 2.0, "turns_per_s": -2.0},
    "bones vary": {"angle_sd_rad": 0.3, "cutoff_hz": 2.0, "offset_sd_m": 0.01},
}
"""Name -> arguments of `random_poses`."""


def position_error_cm(back: ReadBack, poses: Poses) -> NDArray[np.float64]:
    """Distance of each joint from the poses at the same sample, shape (sample_count, joint_count)."""
    truth = to_file_axes(poses.positions_m) * 100.0
    return np.linalg.norm(back.in_order(poses.joint_names).positions_cm - truth, axis=-1)


def rotation_error_deg(back: ReadBack, poses: Poses) -> float:
    """Largest angle between a joint's world rotation and that of the poses."""
    found = back.in_order(poses.joint_names).rotations_wxyz
    truth = np.concatenate(
        [poses.rotations_wxyz[..., :1], to_file_axes(poses.rotations_wxyz[..., 1:])], axis=-1
    )
    sign = np.sign((found * truth).sum(axis=-1, keepdims=True))
    chord = np.linalg.norm(found * sign - truth, axis=-1)  # of the half angle: exact where arccos is not
    return float(np.degrees(4.0 * np.arcsin(np.minimum(chord / 2.0, 1.0))).max())
