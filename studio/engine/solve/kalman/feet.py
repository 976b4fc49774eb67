"""Standing feet in the output pose: held in place as far as the covariance allows.

The filter's state does not include the hold. A foot held by mistake is released as soon as the state has moved on, so
jumps and slides stay possible and no foot locks.
"""

import math

import mujoco
import numpy as np
from numpy.typing import NDArray

from studio.engine.base.compiled import compiled
from studio.engine.model.human.humanoid import Humanoid
from studio.engine.model.human.kinematics import SiteKinematics
from studio.engine.model.joints import INDEX, OUTPUT_OF_CANONICAL_INDEX

Array = NDArray[np.float64]

FEET = np.array([INDEX[n] for n in ("left_ankle", "left_toe", "right_ankle", "right_toe")])

LAND_SPEED_M_S = 0.5
STOP_SPEED_M_S = 0.35
LEAVE_SPEED_M_S = 1.0
"""A landing joint stands below the first speed; one that slid, below the second. It is released above the third."""

LAND_HEIGHT_M = 0.05
LEAVE_HEIGHT_M = 0.09
"""Heights above the floor, beyond those at rest: a joint lands below the first and leaves above the second."""

LEAVE_M = 0.06
"""A joint this far from the place where it is held is released."""

FADE_S = 0.05
"""Blend time of a hold and of a release."""

DRIFT_S = 1.0
"""Time constant with which the place of a hold follows the state."""

SPEED_S = 0.025
FLOOR_S = 4.0
"""Averaging times of the joints' velocities, and of the height on which the feet stand."""

NEAR_FLOOR_M = 0.08
LOWEST_FLOOR_M = -0.3
"""Lowest height at which feet may find the floor at first: a device that loses a body may show it metres deep."""

HOLD_SIGMA_M = 0.003
ENOUGH_M = 0.004
LEAST_HEIGHT = 0.4
"""Lowest height of a joint as a share of that at rest. Feet roll, shoes give, and heights are known to 1 or 2 cm."""

_ITERATIONS = 3


class StandingFeet:
    """Holds standing ankles and toes, frame by frame; rows are left ankle, left toe, right ankle, right toe.

    Attributes:
        stand_m: mean height of standing feet above their height at rest [m]; None until they have stood.
        beside: another performer's feet, whose floor these stand on; None = these feet find it.
    """

    def __init__(self, humanoid: Humanoid, low: Array, high: Array) -> None:
        self._model = humanoid.model
        self._low, self._high = low, high
        self._kinematics = SiteKinematics(humanoid)
        rest = humanoid.skeleton.rest_positions_m[OUTPUT_OF_CANONICAL_INDEX[FEET], 2]
        self._rest = np.maximum(rest, 0.0)
        self.stand_m: float | None = None
        self.beside: StandingFeet | None = None
        self.forget()

    @property
    def floor_m(self) -> float:
        """Height of the floor on which the feet stand [m], where it is below the calibrated one, else 0.

        The calibrated floor may be centimetres off. Feet above it prove less: they may stand on an object.
        """
        if self.beside is not None:
            return self.beside.floor_m
        return 0.0 if self.stand_m is None else min(0.0, self.stand_m)

    def forget(self) -> None:
        """Reset, but keep the floor."""
        self._at = np.zeros((4, 3))
        self._held = np.zeros(4)
        self._stands = np.zeros(4, dtype=bool)
        self._velocity = np.zeros((4, 3))
        self._slid = np.zeros(4, dtype=bool)
        self._asked_s = np.zeros(4)  # how long they have stood by an operator's edit

    def held(
        self,
        q: Array,
        velocity: Array,
        place: Array,
        dt: float,
        stands: NDArray[np.int8] | None = None,
    ) -> Array:
        """Return the configuration with standing feet held, shape (nq,).

        Args:
            q: configuration.
            velocity: shape (nv,).
            place: covariance of the configuration, shape (nv, nv); less certain degrees of freedom move more.
            dt: time since the last frame [s].
            stands: joints that stand (1) or do not (-1), whatever the solve finds, shape (4,); None = unknown.
        """
        here, jacobian = self._linearised(q)
        stood, at = self._stands.copy(), self._at.copy()
        self._follow(here, jacobian @ velocity, dt)
        if stands is not None:
            self._obey(stands, stood, at, here, dt)
        share = (self._held**2 * (3.0 - 2.0 * self._held))[:, None]
        target = here + share * (self._at - here)
        least = self.floor_m + LEAST_HEIGHT * self._rest
        rows = np.flatnonzero((self._held > 0.0) | (target[:, 2] < least))
        if not len(rows):
            return q
        target[:, 2] = np.maximum(target[:, 2], least)
        out = q.copy()
        here = self._reach(out, target, rows, place, here, jacobian)
        under = least - here[:, 2]
        if under.max() > ENOUGH_M:  # a hold that keeps a foot off the floor is released
            low = np.repeat((under > ENOUGH_M).reshape(2, 2).any(axis=1), 2)
            rows = np.flatnonzero((self._held > 0.0) & ~low | (under > 0.0))
            self._reach(out, target, rows, place, *self._linearised(out))
        return out

    def _reach(
        self, q: Array, target: Array, rows: NDArray[np.int64], place: Array, here: Array, jacobian: Array
    ) -> Array:
        """Move some joints to their targets by changing the configuration in place; return their positions.

        `here` and `jacobian` are those of the configuration; positions have the shape (4, 3) [m].
        """
        for iteration in range(_ITERATIONS):
            if iteration:
                jacobian = self._linearised(q)[1]
            j = jacobian[rows].reshape(-1, self._model.nv)
            spread = place @ j.T
            total = j @ spread
            total.flat[:: len(total) + 1] += HOLD_SIGMA_M**2
            step = spread @ np.linalg.solve(total, (target - here)[rows].ravel())
            mujoco.mj_integratePos(self._model, q, step, 1.0)
            np.maximum(np.minimum(q[7:], self._high, out=q[7:]), self._low, out=q[7:])
            here = self._kinematics.place(q)[FEET]
            if np.abs(target - here)[rows].max() < ENOUGH_M:
                break
        return here

    def _linearised(self, q: Array) -> tuple[Array, Array]:
        """Positions, shape (4, 3), and Jacobians, (4, 3, nv), of the feet's joints."""
        positions, jacobian = self._kinematics.linearise(q)
        return positions[FEET], jacobian.reshape(-1, 3, self._model.nv)[FEET]

    def _obey(
        self, stands: NDArray[np.int8], stood: NDArray[np.bool_], at: Array, here: Array, dt: float
    ) -> None:
        """Hold and release feet as an operator's edits say; `stood`, `at`: which stood before, and where.

        The place of a foot held by an edit is the mean of its places in the state so far: it moves less and less.
        """
        step = dt / FADE_S
        self._asked_s = np.where(stands > 0, self._asked_s + dt, 0.0)
        for k in np.flatnonzero(stands):
            was_found = self._stands[k]
            self._stands[k] = stands[k] > 0
            if stands[k] < 0:
                self._held[k] = max(self._held[k] - (2.0 * step if was_found else 0.0), 0.0)
                continue
            share = dt / max(self._asked_s[k], DRIFT_S)
            self._at[k] = at[k] + share * (here[k] - at[k]) if stood[k] else here[k]
            self._at[k, 2] = self._rest[k] + (self.stand_m or 0.0)
            self._held[k] = min(self._held[k] + (0.0 if was_found else 2.0 * step), 1.0)

    def _follow(self, here: Array, velocity: Array, dt: float) -> None:
        """Update which joints stand, where, and the weight of each hold."""
        stand_m = np.nan if self.stand_m is None else self.stand_m
        found = float(
            follow_feet(
                here, velocity, dt, self._rest, stand_m,
                self._velocity, self._at, self._held, self._stands, self._slid,
            )
        )  # fmt: skip
        self.stand_m = None if math.isnan(found) else found


@compiled
def follow_feet(
    here: Array,
    velocity: Array,
    dt: float,
    rest: Array,
    stand_m: float,
    mean_velocity: Array,
    at: Array,
    held: Array,
    stands: NDArray[np.bool_],
    slid: NDArray[np.bool_],
) -> float:
    """Update which feet stand, in place, and return their height above that at rest [m]; NaN = not yet.

    Args:
        here: positions [m], shape (4, 3).
        velocity: of the joints [m/s].
        dt: time since the last frame [s].
        rest: heights at rest [m], shape (4,).
        stand_m: their height above that at rest so far; NaN = they have not stood yet.
        mean_velocity: averaged over `SPEED_S`, shape (4, 3).
        at: place where each stands, shape (4, 3).
        held: weight of its hold, 0..1, shape (4,).
        stands: whether it stands.
        slid: whether it left the floor by sliding, and has not risen since.
    """
    speed, height = np.empty(4), here[:, 2] - rest
    for k in range(4):
        mean_velocity[k] += -math.expm1(-dt / SPEED_S) * (velocity[k] - mean_velocity[k])
        speed[k] = math.sqrt((mean_velocity[k] * mean_velocity[k]).sum())
    if math.isnan(stand_m) and height.mean() > LOWEST_FLOOR_M:
        stand_m = height.mean()
    total, count = 0.0, 0
    for k in range(4):
        if speed[k] < LAND_SPEED_M_S and abs(height[k] - stand_m) < NEAR_FLOOR_M:
            total, count = total + height[k], count + 1
    if count:
        stand_m -= math.expm1(-dt / FLOOR_S) * (total / count - stand_m)
    for k in range(4):
        above = height[k] - stand_m
        off = here[k] - at[k]
        away = (off * off).sum() > LEAVE_M**2
        leaves = stands[k] and (speed[k] > LEAVE_SPEED_M_S or above > LEAVE_HEIGHT_M or away)
        slid[k] = (slid[k] or leaves) and above < LEAVE_HEIGHT_M
        slow = speed[k] < (STOP_SPEED_M_S if slid[k] else LAND_SPEED_M_S)
        if not stands[k] and slow and above < LAND_HEIGHT_M:
            slid[k] = False
            at[k] = here[k] - held[k] * off
            stands[k] = True
        elif leaves:
            stands[k] = False
        if stands[k]:
            at[k] += -math.expm1(-dt / DRIFT_S) * (here[k] - at[k])
        held[k] = min(max(held[k] + (dt if stands[k] else -dt) / FADE_S, 0.0), 1.0)
    return stand_m
