"""Axes that move with each bone, computed from joint positions alone, for offsets fixed in the body."""

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from studio.engine.base.geometry import cross, unit
from studio.engine.model.joints import INDEX


def _limbs(first: str, second: str) -> list[int]:
    """Left and right joints of two names, one of the arm and one of the leg."""
    return [INDEX[f"{side}_{name}"] for side in ("left", "right") for name in (first, second)]


_CHAINS = [
    _limbs(*names) for names in (("shoulder", "hip"), ("elbow", "knee"), ("wrist", "ankle"), ("hand", "toe"))
]
"""Limb joints from the trunk outwards; each joint's bone ends at the joint in the next row."""
_HIPS = [INDEX[name] for name in ("hips", "left_hip", "right_hip")]


def bone_frames(joints: NDArray[np.float64], offsets_m: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return rotations that take T-pose axes to each joint's bone, shape (F, 21, 3, 3).

    Hips and chest follow the body's left and up. A limb's bone turns from its parent's axes without twist. The trunk
    is one bone, and an end joint keeps its parent's axes.

    Args:
        joints: joint centres [m], shape (F, 21, 3).
        offsets_m: T-pose offsets of the body, shape (21, 3); see `CanonicalMotion`.
    """
    frames = np.empty((*joints.shape[:2], 3, 3))
    frames[:] = chest_axes(joints)[:, None]
    frames[:, _HIPS] = _axes(joints[:, INDEX["left_hip"]] - joints[:, INDEX["right_hip"]], _up(joints))[
        :, None
    ]
    for starts, ends in pairwise(_CHAINS):
        before = frames[:, starts]
        rest = (before * offsets_m[ends][:, None, :]).sum(axis=-1)
        turned = _matrix_product(_swing(rest, joints[:, ends] - joints[:, starts]), before)
        frames[:, starts] = frames[:, ends] = turned
    return frames


def chest_axes(joints: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the rotations of the chest, which the head shares, shape (F, 3, 3).

    Args:
        joints: joint centres [m], shape (F, 21, 3).
    """
    return _axes(joints[:, INDEX["left_shoulder"]] - joints[:, INDEX["right_shoulder"]], _up(joints))


def _up(joints: NDArray[np.float64]) -> NDArray[np.float64]:
    return joints[:, INDEX["chest"]] - joints[:, INDEX["hips"]]


def _axes(left: NDArray[np.float64], up: NDArray[np.float64]) -> NDArray[np.float64]:
    """Axes x = left, z = up made perpendicular to it, y = back, shape (F, 3, 3)."""
    x = unit(left)
    y = unit(cross(up, x))
    return np.stack([x, y, cross(x, y)], axis=-1)


def _swing(a: NDArray[np.float64], b: NDArray[np.float64]) -> NDArray[np.float64]:
    """Smallest rotations that turn directions `a` to `b`, shape (..., 3, 3)."""
    a, b = unit(a), unit(b)
    x, y, z = np.moveaxis(cross(a, b), -1, 0)
    c = (a * b).sum(-1)[..., None, None]
    k = np.zeros((*a.shape, 3))
    k[..., 0, 1], k[..., 0, 2], k[..., 1, 2] = -z, y, -x
    k[..., 1, 0], k[..., 2, 0], k[..., 2, 1] = z, -y, x
    return np.eye(3) + k + _matrix_product(k, k) / np.maximum(1 + c, 1e-6)


def _matrix_product(a: NDArray[np.float64], b: NDArray[np.float64]) -> NDArray[np.float64]:
    """a @ b, shapes (..., 3, 3), by plain sums, so that results do not depend on the number of frames."""
    return (a[..., :, :, None] * b[..., None, :, :]).sum(axis=-2)
