"""Poses of an adult of 1.75 m for tests of pictures and of the view."""

import numpy as np
from numpy.typing import NDArray

from studio.engine.model.calibration import Performer
from studio.engine.model.human.skeleton import Skeleton, forward_positions
from studio.engine.model.joints import CANONICAL, OUTPUT_JOINTS, OUTPUT_PARENTS
from studio.engine.model.poses import Poses


def performer() -> Performer:
    """An adult of 1.75 m."""
    offsets = {
        "hips": (0, 0, 0.95), "spine": (0, 0, 0.12), "chest": (0, 0.01, 0.24), "neck": (0, 0, 0.15),
        "head": (0, -0.02, 0.17),
    }  # fmt: skip
    for side, x in (("left", 1), ("right", -1)):
        offsets |= {
            f"{side}_shoulder": (0.18 * x, 0, 0.08), f"{side}_elbow": (0.28 * x, 0, 0),
            f"{side}_wrist": (0.25 * x, 0, 0), f"{side}_hand": (0.09 * x, 0, 0),
            f"{side}_hip": (0.09 * x, 0, -0.05), f"{side}_knee": (0, 0, -0.42),
            f"{side}_ankle": (0, 0.01, -0.405), f"{side}_toe": (0, -0.14, -0.05),
        }  # fmt: skip
    return Performer(1.75, np.array([offsets[name] for name in CANONICAL], dtype=np.float64))


def t_pose() -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Positions (52, 3) and rotations (52, 4) of the T-pose over the stage's origin."""
    skeleton = Skeleton.of(performer())
    positions = forward_positions(skeleton, skeleton.offsets_m[0], np.tile(np.eye(3), (52, 1, 1)))
    return positions, np.tile([1.0, 0.0, 0.0, 0.0], (52, 1))


def sidestep(frame_count: int = 30) -> Poses:
    """A performer in T-pose who slides to the left at 30 Hz."""
    positions, wxyz = t_pose()
    shift = np.linspace(0.0, 0.3, frame_count)[:, None, None] * np.array([1.0, 0.0, 0.0])
    moved = positions[None] + shift
    return Poses(
        time_s=np.arange(frame_count) / 30.0,
        joint_names=OUTPUT_JOINTS,
        parents=OUTPUT_PARENTS,
        positions_m=moved,
        rotations_wxyz=np.tile(wxyz, (frame_count, 1, 1)),
        confidence=np.ones((frame_count, 52)),
        uncertainty_mm=np.full((frame_count, 52), np.nan),
    )
