"""Axes that move with each bone, from joint positions alone, for offsets that are fixed in the body."""

import numpy as np
from numpy.typing import NDArray

from studio.engine.base.geometry import unit
from studio.engine.model.joints import CANONICAL, INDEX, PARENTS

# The end of each joint's bone; the trunk is one bone, and an end keeps its parent's axes.
_NEXT = {f"{side}_{a}": f"{side}_{b}" for side in ("left", "right")
         for a, b in (("shoulder", "elbow"), ("elbow", "wrist"), ("wrist", "hand"),
                      ("hip", "knee"), ("knee", "ankle"), ("ankle", "toe"))}  # fmt: skip


def bone_frames(joints: NDArray[np.float64], offsets_m: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return rotations that take T-pose axes to each joint's bone, shape (F, 21, 3, 3).

    Hips and chest follow the body's left and up; a limb's bone turns on from its parent's without twist.

    Args:
        joints: joint centres [m], shape (F, 21, 3).
        offsets_m: T-pose offsets of the body, shape (21, 3); see `CanonicalMotion`.
    """
    frames = np.empty((*joints.shape[:2], 3, 3))
    up = joints[:, INDEX["chest"]] - joints[:, INDEX["hips"]]
    pelvis = _axes(joints[:, INDEX["left_hip"]] - joints[:, INDEX["right_hip"]], up)
    chest = _axes(joints[:, INDEX["left_shoulder"]] - joints[:, INDEX["right_shoulder"]], up)
    for i, name in enumerate(CANONICAL):
        if name == "hips":
            frames[:, i] = pelvis
        elif name in ("spine", "chest", "neck", "head"):
            frames[:, i] = chest
        else:
            base = {"shoulder": chest, "hip": pelvis}.get(name.split("_")[1])
            frames[:, i] = frames[:, PARENTS[i]] if base is None else base
        if name in _NEXT:
            child = INDEX[_NEXT[name]]
            rest = (frames[:, i] * offsets_m[child]).sum(axis=-1)
            frames[:, i] = _matrix_product(_swing(rest, joints[:, child] - joints[:, i]), frames[:, i])
    return frames


def _axes(left: NDArray[np.float64], up: NDArray[np.float64]) -> NDArray[np.float64]:
    """Axes x = left, z = up made perpendicular to it, y = back, shape (F, 3, 3)."""
    x = unit(left)
    y = unit(np.cross(up, x))
    return np.stack([x, y, np.cross(x, y)], axis=-1)


def _swing(a: NDArray[np.float64], b: NDArray[np.float64]) -> NDArray[np.float64]:
    """Smallest rotations that turn directions `a` to `b`, shape (F, 3, 3)."""
    a, b = unit(a), unit(b)
    v = np.cross(a, b)
    c = (a * b).sum(-1)[:, None, None]
    k = np.zeros((len(a), 3, 3))
    k[:, 0, 1], k[:, 0, 2], k[:, 1, 2] = -v[:, 2], v[:, 1], -v[:, 0]
    k[:, 1, 0], k[:, 2, 0], k[:, 2, 1] = v[:, 2], -v[:, 1], v[:, 0]
    return np.eye(3) + k + _matrix_product(k, k) / np.maximum(1 + c, 1e-6)


def _matrix_product(a: NDArray[np.float64], b: NDArray[np.float64]) -> NDArray[np.float64]:
    """a @ b, shapes (..., 3, 3), by plain sums, so that one frame gives the same bits as many."""
    return (a[..., :, :, None] * b[..., None, :, :]).sum(axis=-2)
