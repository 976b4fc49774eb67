"""Tracks of the cameras' joints: how long each has moved without a jump."""

import numpy as np
from numpy.typing import NDArray

from studio.engine.model.joints import JOINT_COUNT

SPEED_CHANGE_M_S = 2.5
NOISE_SHARE = 0.4
"""Limits of a joint's change in velocity between frames: a fixed part, and a share of its noise. Above, it jumps."""

GAP_S = 0.1
"""A joint unseen for longer than this starts a new track."""


class Courses:
    """Follows each joint of each camera, frame by frame.

    Attributes:
        steady_s: time for which each joint has moved without a jump [s], shape (camera_count, 21).
    """

    def __init__(self, camera_count: int) -> None:
        shape = (camera_count, JOINT_COUNT)
        self.steady_s = np.zeros(shape)
        self._last = np.zeros((*shape, 3))
        self._velocity = np.zeros((*shape, 3))
        self._elapsed_s = np.full(shape, np.inf)

    def follow(
        self, positions: NDArray[np.float64], noise: NDArray[np.float64], seen: NDArray[np.bool_], dt: float
    ) -> NDArray[np.float64]:
        """Return `steady_s` after the next frame.

        Args:
            positions: joints [m], shape (camera_count, 21, 3).
            noise: their covariances [m2], shape (camera_count, 21, 3, 3).
            seen: shape (camera_count, 21).
            dt: time since the last frame [s].
        """
        elapsed = self._elapsed_s + dt
        step = np.where(seen[:, :, None], positions, 0.0) - self._last
        usable = np.clip(elapsed, 1e-3, GAP_S)[:, :, None]
        surprise = step - usable * self._velocity
        spread = np.sqrt(np.trace(noise, axis1=2, axis2=3))
        allowed = SPEED_CHANGE_M_S * usable[:, :, 0] + NOISE_SHARE * spread
        smooth = (elapsed < GAP_S) & ((surprise * surprise).sum(axis=2) < allowed * allowed)
        self.steady_s = np.where(seen, np.where(smooth, self.steady_s + dt, 0.0), self.steady_s)
        self._velocity = np.where(seen[:, :, None], step / usable, self._velocity)
        self._last = np.where(seen[:, :, None], positions, self._last)
        self._elapsed_s = np.where(seen, 0.0, elapsed)
        return self.steady_s
