"""Standing feet in the pose that is put out: held where they stand, as far as the belief allows.

The belief itself knows nothing of it: a foot held by mistake is let go as soon as the belief has moved on, so that
jumps and slides stay possible and nothing locks.
"""

import math

import mujoco
import numpy as np
from numpy.typing import NDArray

from studio.engine.human.kinematics import SiteKinematics
from studio.engine.human.model import Humanoid
from studio.engine.joints import INDEX, OUTPUT_OF_CANONICAL_INDEX

Array = NDArray[np.float64]

FEET = np.array([INDEX[n] for n in ("left_ankle", "left_toe", "right_ankle", "right_toe")])

LAND_SPEED_M_S = 0.6
STOP_SPEED_M_S = 0.25
LEAVE_SPEED_M_S = 1.0
"""A joint that comes down stands below the first speed, one that slid below the second; it leaves above the third."""

LAND_HEIGHT_M = 0.05
LEAVE_HEIGHT_M = 0.09
"""Heights above the floor that the feet stand on, beside those at rest."""

LEAVE_M = 0.06
"""A joint this far from where it is held is let go."""

FADE_S = 0.05
"""Time in which a joint is taken hold of, or let go."""

DRIFT_S = 1.0
"""The place where a joint is held follows the belief over this time."""

SPEED_S = 0.025
FLOOR_S = 2.0
"""How high the feet stand is averaged over this time."""

NEAR_FLOOR_M = 0.08
HOLD_SIGMA_M = 0.003
ENOUGH_M = 0.004
LEAST_HEIGHT = 0.4
"""A joint may sink to this share of its height at rest: feet roll, shoes give, and heights are known to 1 or 2 cm."""

_ITERATIONS = 2


class StandingFeet:
    """Holds standing ankles and toes, frame by frame; rows are left ankle, left toe, right ankle, right toe.

    Attributes:
        stand_m: how far above their height at rest the feet stand, on average [m]; None until they have.
    """

    def __init__(self, humanoid: Humanoid, low: Array, high: Array) -> None:
        self._model = humanoid.model
        self._low, self._high = low, high
        self._kinematics = SiteKinematics(humanoid)
        rest = humanoid.skeleton.rest_positions_m[OUTPUT_OF_CANONICAL_INDEX[FEET], 2]
        self._rest = np.maximum(rest, 0.0)
        self.stand_m: float | None = None
        self.forget()

    @property
    def floor_m(self) -> float:
        """Height of the floor that the feet stand on [m], where they sink beneath the calibrated one, else 0.

        The calibrated floor may be centimetres off. Feet that stand too high tell less: they may stand on something.
        """
        return 0.0 if self.stand_m is None else min(0.0, self.stand_m)

    def forget(self) -> None:
        """Begin anew, on the same floor."""
        self._at = np.zeros((4, 3))
        self._held = np.zeros(4)
        self._stands = np.zeros(4, dtype=bool)
        self._velocity = np.zeros((4, 3))
        self._slid = np.zeros(4, dtype=bool)

    def held(self, q: Array, velocity: Array, place: Array, dt: float) -> Array:
        """Return the configuration with standing feet held, shape (nq,).

        Args:
            q: configuration.
            velocity: shape (nv,).
            place: covariance of the configuration, shape (nv, nv): what is less sure gives way first.
            dt: time since the last frame [s].
        """
        here, jacobian = self._linearised(q)
        self._follow(here, jacobian @ velocity, dt)
        share = (self._held**2 * (3.0 - 2.0 * self._held))[:, None]
        target = here + share * (self._at - here)
        least = self.floor_m + LEAST_HEIGHT * self._rest
        rows = np.flatnonzero((self._held > 0.0) | (target[:, 2] < least))
        if not len(rows):
            return q
        target[:, 2] = np.maximum(target[:, 2], least)
        out, off = q.copy(), (target - here)[rows].ravel()
        for _ in range(_ITERATIONS):
            j = jacobian[rows].reshape(-1, self._model.nv)
            spread = place @ j.T
            total = j @ spread
            total.flat[:: len(total) + 1] += HOLD_SIGMA_M**2
            mujoco.mj_integratePos(self._model, out, spread @ np.linalg.solve(total, off), 1.0)
            np.clip(out[7:], self._low, self._high, out=out[7:])
            off = (target - self._kinematics.place(out)[FEET])[rows].ravel()
            if np.abs(off).max() < ENOUGH_M:
                break
            jacobian = self._linearised(out)[1]
        return out

    def _linearised(self, q: Array) -> tuple[Array, Array]:
        """Positions, shape (4, 3), and Jacobians, (4, 3, nv), of the feet's joints."""
        positions, jacobian = self._kinematics.linearise(q)
        return positions[FEET], jacobian.reshape(-1, 3, self._model.nv)[FEET]

    def _follow(self, here: Array, velocity: Array, dt: float) -> None:
        """Update which joints stand, where, and how firmly they are held."""
        self._velocity += -math.expm1(-dt / SPEED_S) * (velocity - self._velocity)
        speed = np.sqrt((self._velocity * self._velocity).sum(axis=1))
        height = here[:, 2] - self._rest
        if self.stand_m is None:
            self.stand_m = float(height.mean())
        slow = (speed < LAND_SPEED_M_S) & (np.abs(height - self.stand_m) < NEAR_FLOOR_M)
        if slow.any():
            self.stand_m -= math.expm1(-dt / FLOOR_S) * (
                float(height[slow].sum()) / int(slow.sum()) - self.stand_m
            )
        height -= self.stand_m
        off = here - self._at
        away = (off * off).sum(axis=1) > LEAVE_M**2
        leaves = self._stands & ((speed > LEAVE_SPEED_M_S) | (height > LEAVE_HEIGHT_M) | away)
        self._slid = (self._slid | leaves) & (height < LEAVE_HEIGHT_M)
        slow = speed < np.where(self._slid, STOP_SPEED_M_S, LAND_SPEED_M_S)
        lands = ~self._stands & slow & (height < LAND_HEIGHT_M)
        self._slid &= ~lands
        if lands.any():
            self._at[lands] = here[lands] + self._held[lands, None] * (self._at - here)[lands]
        self._stands = (self._stands & ~leaves) | lands
        self._at += (-math.expm1(-dt / DRIFT_S) * self._stands)[:, None] * (here - self._at)
        self._held += np.where(self._stands, dt, -dt) / FADE_S
        np.maximum(np.minimum(self._held, 1.0, out=self._held), 0.0, out=self._held)
