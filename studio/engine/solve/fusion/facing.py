"""Facing of a skeleton, which shows whether its left and right are exchanged.

A tracker that takes a performer's back for the front exchanges left and right. Within one frame only the feet and
knees show this: the feet point backwards (toes lie in front of ankles), and the knees bend backwards.
"""

import numpy as np
from numpy.typing import NDArray

from studio.engine.model.joints import INDEX, MIRROR

WRONG = -0.3
"""A skeleton faces backwards where its mean `forwardness` is below this."""

MEMORY_S = 0.6
"""Time over which the mean is taken."""

SURE = 0.7
"""Lowest confidence of a camera's foot for which its direction counts."""

UPRIGHT = 0.75
"""Trunk and thighs are upright where the vertical part of their direction exceeds this; only then do feet count."""

BENT = 0.5
"""Knees count from this sum of the sines of their bends, about the axis through both hips."""

_LEFT = [INDEX[name] for name in ("left_hip", "left_shoulder")]
_RIGHT = [INDEX[name] for name in ("right_hip", "right_shoulder")]
_ANKLES = [INDEX["left_ankle"], INDEX["right_ankle"]]
_TOES = [INDEX["left_toe"], INDEX["right_toe"]]
_LEGS = [INDEX["left_hip"], INDEX["right_hip"]]
_KNEES = [INDEX["left_knee"], INDEX["right_knee"]]
_NECK, _HIPS = INDEX["neck"], INDEX["hips"]


def forwardness(joints: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the degree to which feet point, and knees bend, to the front of the body, -1..1, shape (...).

    NaN where it is unknown: unseen joints, or a performer who bends, sits or lifts a leg with straight knees.

    Args:
        joints: canonical joints [m], shape (..., 21, 3); NaN = unseen.
    """
    left = (joints[..., _LEFT, :] - joints[..., _RIGHT, :]).sum(axis=-2)
    told = np.stack([_feet_forward(joints, left), _knees_forward(joints, left)])
    known = ~np.isnan(told)
    return np.where(known, told, 0.0).sum(axis=0) / np.where(known.any(axis=0), known.sum(axis=0), np.nan)


def _feet_forward(joints: NDArray[np.float64], left: NDArray[np.float64]) -> NDArray[np.float64]:
    trunk = joints[..., _NECK, :] - joints[..., _HIPS, :]
    front = np.cross(left, trunk)
    thighs = joints[..., _LEGS, :] - joints[..., _KNEES, :]
    upright = (_vertical(trunk) > UPRIGHT) & (_vertical(thighs) > UPRIGHT).all(axis=-1)
    feet = (joints[..., _TOES, :] - joints[..., _ANKLES, :]).sum(axis=-2)
    length = np.linalg.norm(front, axis=-1) * np.linalg.norm(feet, axis=-1)
    return np.einsum("...k,...k->...", front, feet) / np.where(upright & (length > 1e-9), length, np.nan)


def _knees_forward(joints: NDArray[np.float64], left: NDArray[np.float64]) -> NDArray[np.float64]:
    thighs = joints[..., _KNEES, :] - joints[..., _LEGS, :]
    shins = joints[..., _ANKLES, :] - joints[..., _KNEES, :]
    length = np.linalg.norm(thighs, axis=-1) * np.linalg.norm(shins, axis=-1)
    axes = np.cross(thighs, shins) / np.where(length > 1e-9, length, np.nan)[..., None]
    width = np.linalg.norm(left, axis=-1)
    bends = np.einsum("...ik,...k->...", axes, left) / np.where(width > 1e-9, width, np.nan)
    return np.clip(np.where(np.abs(bends) > BENT, bends, np.nan), -1.0, 1.0)


def _vertical(vectors: NDArray[np.float64]) -> NDArray[np.float64]:
    """The vertical part of each vector's direction, -1..1; 0 for a zero vector."""
    return vectors[..., 2] / np.maximum(np.linalg.norm(vectors, axis=-1), 1e-9)


def exchanged_at_first(positions: NDArray[np.float64], confidence: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Return the cameras whose left and right are exchanged in the first frame, shape (camera_count,).

    Each camera is matched to the one with the highest confidence. If the feet of their mean then point backwards, all
    are exchanged, unless the cameras' own do not on average. Feet of low confidence do not count.

    Args:
        positions: joints per camera in the stage frame [m], shape (camera_count, 21, 3); NaN = unseen.
        confidence: shape (camera_count, 21).
    """
    first = positions[int(confidence.sum(axis=1).argmax())]
    as_is = np.nan_to_num(np.minimum(np.linalg.norm(positions - first, axis=2), 0.3)).sum(axis=1)
    mirrored = np.nan_to_num(np.minimum(np.linalg.norm(positions[:, MIRROR] - first, axis=2), 0.3)).sum(
        axis=1
    )
    exchanged = mirrored < 0.7 * as_is
    sure = np.where((confidence > SURE)[:, :, None], positions, np.nan)
    agreed = np.where(exchanged[:, None, None], sure[:, MIRROR], sure)
    known = ~np.isnan(agreed[:, :, :1])
    middle = np.where(known, agreed, 0.0).sum(axis=0) / np.where(known.any(axis=0), known.sum(axis=0), np.nan)
    each = forwardness(agreed)
    each = each[~np.isnan(each)]
    vetoed = len(each) > 0 and each.mean() >= WRONG  # one camera's wild feet pull the middle round
    return ~exchanged if forwardness(middle) < WRONG and not vetoed else exchanged


class Facing:
    """Detects a tracked skeleton that faces backwards."""

    def __init__(self) -> None:
        self._ahead = 0.5

    def backwards(self, joints: NDArray[np.float64], dt: float) -> bool:
        """Add the skeleton, shape (21, 3), `dt` [s] after the last. Return True once it has faced backwards for a
        while, and start again then.
        """
        ahead = float(forwardness(joints))
        if ahead == ahead:
            self._ahead += (1.0 - np.exp(-dt / MEMORY_S)) * (ahead - self._ahead)
        if self._ahead >= WRONG:
            return False
        self._ahead = 0.5
        return True
