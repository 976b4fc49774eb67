"""A body's proportions as T-pose offsets, and those of the authored performer."""

import numpy as np
from numpy.typing import NDArray

from studio.engine.model.joints import CANONICAL, INDEX, PARENTS

TOE_HEIGHT_M = 0.025
"""Height of the toe joint of a standing foot above the floor."""

_SIDE_M: dict[str, tuple[float, float, float]] = {
    "shoulder": (0.178, 0.012, 0.128), "elbow": (0.288, 0.0, 0.0), "wrist": (0.258, 0.0, 0.0),
    "hand": (0.092, 0.0, 0.0), "hip": (0.092, 0.0, -0.068), "knee": (0.0, 0.0, -0.432),
    "ankle": (0.0, 0.0, -0.418), "toe": (0.0, -0.142, -0.062),
}  # fmt: skip


def _authored() -> NDArray[np.float64]:
    offsets = np.zeros((len(CANONICAL), 3))
    offsets[INDEX["spine"]] = (0.0, 0.012, 0.108)
    offsets[INDEX["chest"]] = (0.0, 0.010, 0.212)
    offsets[INDEX["neck"]] = (0.0, 0.004, 0.186)
    offsets[INDEX["head"]] = (0.0, -0.018, 0.104)
    for sign, side in ((1.0, "left"), (-1.0, "right")):
        for joint, (x, y, z) in _SIDE_M.items():
            offsets[INDEX[f"{side}_{joint}"]] = (sign * x, y, z)
    offsets[INDEX["hips"], 2] = _hips_height(offsets)
    return offsets


def _hips_height(offsets: NDArray[np.float64]) -> float:
    """Height of the hips [m] that puts the lower toe joint at its standing height."""
    drops = [
        -sum(offsets[INDEX[f"{side}_{joint}"], 2] for joint in ("hip", "knee", "ankle", "toe"))
        for side in ("left", "right")
    ]
    return float(max(drops)) + TOE_HEIGHT_M


AUTHORED_OFFSETS: NDArray[np.float64] = _authored()
"""T-pose offsets of the authored performer, about 1.78 m tall, shape (21, 3) [m]; see `CanonicalMotion`."""


def t_pose_offsets(rest: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return T-pose offsets of a body whose joints in some upright rest pose are `rest`, both (21, 3) [m].

    The trunk keeps its shape and is turned to face -y; the arms lie along x, the legs point straight down.
    """
    across = (rest[INDEX[f"left_{j}"]] - rest[INDEX[f"right_{j}"]] for j in ("hip", "shoulder"))
    lateral = sum(across, start=np.zeros(3))
    yaw = np.arctan2(lateral[1], lateral[0])
    turn = np.array([[np.cos(yaw), np.sin(yaw), 0], [-np.sin(yaw), np.cos(yaw), 0], [0, 0, 1.0]])
    offsets = np.zeros((len(CANONICAL), 3))
    for i, parent in enumerate(PARENTS):
        if parent >= 0:
            offsets[i] = turn @ (rest[i] - rest[parent])
    for sign, side in ((1.0, "left"), (-1.0, "right")):
        for joint in ("elbow", "wrist", "hand"):
            i = INDEX[f"{side}_{joint}"]
            offsets[i] = (sign * np.linalg.norm(offsets[i]), 0.0, 0.0)
        for joint in ("knee", "ankle"):
            i = INDEX[f"{side}_{joint}"]
            offsets[i] = (0.0, 0.0, -np.linalg.norm(offsets[i]))
        i = INDEX[f"{side}_toe"]
        length = float(np.linalg.norm(offsets[i]))
        down = float(np.clip(-offsets[i, 2], 0.2 * length, 0.7 * length))
        offsets[i] = (0.0, -np.sqrt(length**2 - down**2), -down)
    offsets[INDEX["hips"]] = (0.0, 0.0, _hips_height(offsets))
    return offsets
