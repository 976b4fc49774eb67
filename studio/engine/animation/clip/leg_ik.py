"""Two-bone inverse kinematics: the leg from hip to ankle, for all frames at once, in closed form."""

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

Array = NDArray[np.float64]

MOST_STRETCH = 0.8
"""A bent leg stretches by less than this share of its distance to straight, because the knee would jump near
straight."""


def reach(
    hip: Array, knee: Array, ankle: Array, target: Array, side: Array, *, soft: bool = True
) -> tuple[Rotation, Rotation]:
    """Return the rotations of the thigh and the shin (world axes) that bring the ankle to the target.

    The knee stays in the plane of hip, knee and ankle, which turns with the ankle about the hip. The further a
    target stretches the leg, the less the leg follows. With `soft` it never becomes straight.

    Args:
        hip, knee, ankle, target: shape (F, 3) [m].
        side: the knee's axis where the leg is straight, shape (F, 3).
        soft: False reaches every target that the straight leg can.
    """
    thigh, shin = np.linalg.norm(knee - hip, axis=1), np.linalg.norm(ankle - knee, axis=1)
    now, then = np.linalg.norm(ankle - hip, axis=1), np.linalg.norm(target - hip, axis=1)
    now = np.minimum(now, thigh + shin)
    room = np.maximum(MOST_STRETCH * (thigh + shin - now), 1e-9)
    further = np.maximum(then - now, 0.0)
    followed = room * (1.0 - np.exp(-further / room)) if soft else np.minimum(further, thigh + shin - now)
    then = np.minimum(then, now) + followed
    then = np.maximum(then, np.abs(thigh - shin) + 1e-6)
    axis = np.cross(knee - hip, ankle - hip)
    size = np.linalg.norm(axis, axis=1, keepdims=True)
    axis = np.where(size > 1e-4 * (thigh * now)[:, None], axis / np.maximum(size, 1e-12), side)
    at_hip = _angle(thigh, then, shin) - _angle(thigh, now, shin)
    at_knee = _angle(thigh, shin, then) - _angle(thigh, shin, now)
    open_hip = Rotation.from_rotvec(-at_hip[:, None] * axis)
    bend = Rotation.from_rotvec((-at_hip - at_knee)[:, None] * axis)
    ankle_then = hip + open_hip.apply(knee - hip) + bend.apply(ankle - knee)
    swing = between(ankle_then - hip, target - hip)
    return swing * open_hip, swing * bend


def between(start: Array, end: Array) -> Rotation:
    """Return the smallest rotations that turn vectors into the direction of others, shapes (F, 3)."""
    axis = np.cross(start, end)
    sine, cosine = np.linalg.norm(axis, axis=1), (start * end).sum(axis=1)
    angle = np.arctan2(sine, cosine)
    return Rotation.from_rotvec(axis / np.maximum(sine, 1e-12)[:, None] * angle[:, None])


def _angle(a: Array, b: Array, opposite: Array) -> Array:
    """Return the angle between two sides of a triangle [rad]."""
    return np.arccos(np.clip((a**2 + b**2 - opposite**2) / (2 * a * b), -1.0, 1.0))
