"""Floor contact: feet stay above the floor, and standing feet stay in place.

Before the solve, `FloorContact.targets` lifts ankles and toes that are under the floor and holds those that
stand, each by itself, so that a heel may rise while the toe stays. After the solve, `lift` raises a pose whose feet
are still under the floor. A joint is released as soon as it rises or moves away from the place where it was held, so
that jumps and slides remain possible.
"""

import numpy as np
from numpy.typing import NDArray

from studio.engine.model.human.skeleton import Skeleton
from studio.engine.model.joints import INDEX, OUTPUT_INDEX

STAND_HEIGHT_M = 0.04
"""Largest height of a standing joint above its height in the T-pose."""

LEAST_HEIGHT = 0.4
"""Lowest height of a joint as a share of its height in the T-pose. Feet roll, shoes give, and the T-pose's heights
are known to a centimetre or two.
"""

STAND_SPEED_M_S = 0.25
LEAVE_SPEED_M_S = 0.60
"""A joint stands below the first speed, and is released above the second."""

LEAVE_M = 0.06
"""A joint this far from the place where it is held is released."""

HOLD_S = 0.12
"""Blend time of a hold; a release takes half of it."""

HOLD_SIGMA_M = 0.008
"""Standard deviation of a held joint."""

_SPEED_S = 0.06
_ANCHOR_S = 0.5
_JOINTS = np.array([INDEX[n] for n in ("left_ankle", "left_toe", "right_ankle", "right_toe")])
_OUTPUTS = np.array([OUTPUT_INDEX[n] for n in ("LeftFoot", "LeftToeBase", "RightFoot", "RightToeBase")])


class FloorContact:
    """Holds standing ankles and toes, frame by frame; rows are left ankle, left toe, right ankle, right toe."""

    def __init__(self, skeleton: Skeleton) -> None:
        self._height = np.maximum(skeleton.rest_positions_m[_OUTPUTS, 2], 0.0)
        self._anchor = np.full((4, 3), np.nan)
        self._held = np.zeros(4)  # 0 = free, 1 = held
        self._last = np.full((4, 3), np.nan)
        self._velocity = np.zeros((4, 3))

    def targets(
        self, joints: NDArray[np.float64], sigma: NDArray[np.float64], dt: float
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return canonical joints [m], shape (21, 3), and deviations, shape (21,), with the feet on the floor."""
        joints, sigma = joints.copy(), sigma.copy()
        here = joints[_JOINTS]
        here[:, 2] = np.maximum(here[:, 2], LEAST_HEIGHT * self._height)  # keeps NaN
        self._follow(here, dt)
        held = np.where(np.isnan(here[:, 0]), 0.0, self._held)
        anchored = np.where(np.isnan(self._anchor), here, self._anchor)
        joints[_JOINTS] = here + held[:, None] * (anchored - here)
        sigma[_JOINTS] += held * (np.minimum(HOLD_SIGMA_M, sigma[_JOINTS]) - sigma[_JOINTS])
        return joints, sigma

    def _follow(self, here: NDArray[np.float64], dt: float) -> None:
        """Update which joints stand, where, and the weight of each hold."""
        if dt > 0:
            velocity = (here - self._last) / dt
            share = 1.0 - np.exp(-dt / _SPEED_S)
            self._velocity = np.where(
                np.isnan(velocity), 0.0, self._velocity + share * (velocity - self._velocity)
            )
        self._last = here
        speed = np.linalg.norm(self._velocity, axis=1)
        low = here[:, 2] - self._height < STAND_HEIGHT_M
        free = np.isnan(self._anchor[:, 0])
        lands = free & low & (speed < STAND_SPEED_M_S)
        away = np.linalg.norm(here - self._anchor, axis=1) > LEAVE_M
        stands = ~free & low & (speed < LEAVE_SPEED_M_S) & ~away
        rate = np.where(stands | lands, 1.0, -2.0) * dt / HOLD_S
        self._held = np.clip(self._held + rate, 0.0, 1.0)
        self._anchor[lands] = here[lands]
        drift = (1.0 - np.exp(-dt / _ANCHOR_S)) * (here - self._anchor)
        self._anchor[stands] += drift[stands]
        self._anchor[~stands & ~lands & (self._held == 0.0)] = np.nan

    def lift(self, positions: NDArray[np.float64]) -> float:
        """Return the lift that brings the feet of a pose, shape (52, 3) [m], above the floor."""
        return max(0.0, float((LEAST_HEIGHT * self._height - positions[_OUTPUTS, 2]).max()))
