"""Euler angles for animation curves: unrolled, without jumps, away from gimbal lock.

An order such as "ZXY" means R = Rz @ Rx @ Ry, the order of BVH channels. Angles are listed by axis (x, y, z),
whatever the order.
"""

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from studio.engine.base.quaternions import IDENTITY, multiply

ORDERS: tuple[str, ...] = ("ZYX", "YZX", "XZY", "ZXY", "YXZ", "XYZ")
"""Every order of three axes; its index is FBX's `RotationOrder`, which names the orders backwards."""

_GIMBAL_COSINE = 1e-6
_NEAR_LOCK_SINE = 0.8


def euler_deg(rotations_wxyz: NDArray[np.float64], order: str) -> NDArray[np.float64]:
    """Return unrolled Euler angles [deg] by axis (x, y, z), shape (frame_count, 3).

    Each frame takes the one of its two branches that is nearer to the frame before, and whole turns are added so that
    no angle jumps: a turn of three rounds ends at 1080 degrees.

    Args:
        rotations_wxyz: unit quaternions, shape (frame_count, 4).
        order: one of `ORDERS`.
    """
    i, j, k = ("XYZ".index(axis) for axis in order)
    sign = 1.0 if (j - i) % 3 == 1 else -1.0
    m = Rotation.from_quat(rotations_wxyz, scalar_first=True).as_matrix()  # (frame_count, 3, 3)
    cosine = np.hypot(m[:, i, i], m[:, i, j])
    first = np.arctan2(-sign * m[:, j, k], m[:, k, k])
    middle = np.arctan2(sign * m[:, i, k], cosine)
    last = np.arctan2(-sign * m[:, i, j], m[:, i, i])
    locked = cosine < _GIMBAL_COSINE
    if locked.any():  # only first +- last is known: keep the last one
        last = _held(last, locked)
        column = sign * np.sin(last)[:, None] * m[:, :, i] + np.cos(last)[:, None] * m[:, :, j]
        first = np.where(locked, np.arctan2(sign * column[:, k], column[:, j]), first)
    angles = np.empty((len(m), 3))
    angles[:, [i, j, k]] = _unrolled(np.degrees(np.stack([first, middle, last], axis=1)))
    return angles


def from_euler(angles_deg: NDArray[np.float64], order: str) -> NDArray[np.float64]:
    """Return the rotations of angles by axis (x, y, z), shape (frame_count, 3), as quaternions (wxyz)."""
    half = np.radians(angles_deg) / 2
    out = np.tile(IDENTITY, (len(half), 1))
    for axis in order:
        k = "XYZ".index(axis)
        turn = np.zeros((len(half), 4))
        turn[:, 0], turn[:, 1 + k] = np.cos(half[:, k]), np.sin(half[:, k])
        out = multiply(out, turn)
    return out


def best_order(rotations_wxyz: NDArray[np.float64]) -> str:
    """Return "ZYX" if its middle angle stays under 53 degrees, else the order that stays furthest from gimbal lock.

    Near the lock the outer angles change fast, and a curve through them leaves the motion between its keys.
    """
    m = Rotation.from_quat(rotations_wxyz, scalar_first=True).as_matrix()
    sines = [m[:, "XYZ".index(order[0]), "XYZ".index(order[2])] for order in ORDERS]  # of the middle angle +-
    if np.abs(sines[0]).max() < _NEAR_LOCK_SINE:
        return ORDERS[0]
    costs = [float(np.mean(1.0 / np.maximum(1.0 - sine**2, 1e-3))) for sine in sines]
    return ORDERS[int(np.argmin(costs))]


def _held(angles: NDArray[np.float64], locked: NDArray[np.bool_]) -> NDArray[np.float64]:
    """Return angles with each locked frame at the last unlocked one before it, or 0."""
    frames = np.where(locked, -1, np.arange(len(angles)))
    source = np.maximum.accumulate(frames)
    return np.where(source >= 0, angles[source], 0.0)


def _unrolled(angles_deg: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return (first, middle, last) angles on the branch and in the turn nearest to the frame before.

    The step between two frames is equally long on both branches. Whether a frame changes branch therefore does not
    depend on the branch so far, and a count of the changes gives the branch.
    """
    other = np.stack([angles_deg[:, 0] + 180.0, 180.0 - angles_deg[:, 1], angles_deg[:, 2] + 180.0], axis=1)

    def distance(a: NDArray[np.float64], b: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.abs((a - b + 180.0) % 360.0 - 180.0).sum(axis=1)

    changes = distance(other[1:], angles_deg[:-1]) < distance(angles_deg[1:], angles_deg[:-1])
    on_other = np.concatenate([[False], np.cumsum(changes) % 2 == 1])
    return np.unwrap(np.where(on_other[:, None], other, angles_deg), axis=0, period=360.0)
