"""The filter's state: configuration, velocity and their covariance, with the motion prior."""

import mujoco
import numpy as np
from numpy.typing import NDArray

from studio.engine.model.human.humanoid import BODY_JOINTS, FREE_DOFS, Humanoid
from studio.engine.model.human.ranges import dofs_of
from studio.engine.solve.ik.twist import LimbTwists
from studio.engine.solve.kalman.kernels import lessen, move_on

Array = NDArray[np.float64]

REFERENCE_S = 1.0 / 30.0
"""The accelerations below are means over an interval of this length; the spectral density follows from it."""

VELOCITY_MEMORY_S = 0.2
"""Decay time of a velocity."""

REST_PER_S = 1.0
"""Weight of the pull to the resting stance, in units of each hinge's usual spread, for hinges that no joint shows."""

LIVELY_S = 0.6
LIVELY_RANGE = (0.3, 3.0)
"""Adaptive process noise: each degree of freedom's acceleration variance, relative to the usual, is the ratio of
observed to expected corrections of its velocity over this time, within this range. Source: covariance matching
(Mehra, "Approaches to adaptive filtering", IEEE Trans. Automatic Control 17, 1972).
"""

MOST_CORRECTED = 5.0
LEAST_VARIANCE = 1e-12
"""A correction is clipped at this many of its standard deviations; one with a smaller expected variance [(rad/s)2]
is ignored."""

LONGEST_BACK = 0.3
"""Largest smoothing step of a degree of freedom [m, rad]."""

START_SIGMA = 0.1
START_VELOCITY_SIGMA = 2.0
"""Standard deviations at the start: [m, rad] and [m/s, rad/s]."""

# Standard deviation of accelerations [m/s2, rad/s2] by output joint, the free hips first.
_HIPS = (11.0, 11.0, 14.0, 26.0, 26.0, 26.0)
_OF_HINGE = {"ForeArm_twist": 24.0, "Foot_turn": 14.0}
_ACCELERATION = {
    "Spine": 14.0, "Spine1": 14.0, "Spine2": 14.0, "Neck": 22.0, "Head": 22.0, "Shoulder": 22.0, "Arm": 48.0,
    "ForeArm": 60.0, "Hand": 24.0, "UpLeg": 42.0, "Leg": 60.0, "Foot": 30.0, "ToeBase": 24.0,
}  # fmt: skip


def acceleration_density(freedom: Array) -> Array:
    """Return the spectral density of each degree of freedom's acceleration [rad2/s3], shape (nv,).

    Args:
        freedom: of each degree of freedom, 1 = as usual, shape (nv,).
    """
    hinges = [
        _OF_HINGE.get(f"{_unsided(joint)}_{dof.name}", _ACCELERATION[_unsided(joint)])
        for joint in BODY_JOINTS[1:]
        for dof in dofs_of(joint)
    ]
    return (np.array([*_HIPS, *hinges]) * freedom) ** 2 * REFERENCE_S


def _unsided(joint: str) -> str:
    return joint.removeprefix("Left").removeprefix("Right")


class Belief:
    """Configuration, velocity and covariance of a humanoid at one instant.

    Attributes:
        q: configuration, shape (nq,).
        velocity: shape (nv,).
        covariance: of the configuration's tangent (first) and the velocity, shape (2 nv, 2 nv).
    """

    def __init__(self, humanoid: Humanoid, density: Array, low: Array, high: Array) -> None:
        """`density`: see `acceleration_density`; `low`, `high`: ends of the hinges' ranges, shape (hinge_count,)."""
        self._humanoid, self._model, self._density = humanoid, humanoid.model, density.copy()
        self._low, self._high = low, high
        self._usual_density, self._twists = density, LimbTwists(humanoid)
        nv = self._model.nv
        self._rest_rate = REST_PER_S / humanoid.spread_rad**2
        self.covariance = np.zeros((2 * nv, 2 * nv))
        self._places, self._speeds = np.arange(nv), np.arange(nv, 2 * nv)
        self._lively, self._uncorrected_s = np.ones(nv), 0.0
        self.begin(humanoid.rest_qpos)

    @property
    def place(self) -> Array:
        """Covariance of the configuration's tangent, shape (nv, nv)."""
        return self.covariance[: self._model.nv, : self._model.nv]

    def begin(self, q: Array) -> None:
        """Restart at a configuration, with zero velocity."""
        self.q = self.within(q.copy())
        self.velocity = np.zeros(self._model.nv)
        self._told, self._before = np.zeros(2 * self._model.nv), None
        self._lively[:], self._uncorrected_s = 1.0, 0.0
        self.covariance[:] = 0.0
        self.covariance[self._places, self._places] = START_SIGMA**2
        self.covariance[self._speeds, self._speeds] = START_VELOCITY_SIGMA**2

    def within(self, q: Array) -> Array:
        """Clamp a configuration's hinges to their ranges, in place."""
        np.clip(q[7:], self._low, self._high, out=q[7:])
        return q

    def moved(self, dt: float) -> Array:
        """The predicted configuration after `dt` [s]."""
        q = self.q.copy()
        mujoco.mj_integratePos(self._model, q, self.velocity, dt)
        return self.within(q)

    def predict(self, dt: float) -> None:
        """Predict the state after `dt` [s]. A weak measurement of each hinge at rest moves unobserved hinges to the
        resting stance.
        """
        self._told[:] = 0.0
        before = self.q.copy(), self.velocity.copy(), self.covariance.copy()
        mujoco.mj_integratePos(self._model, self.q, self.velocity, dt)
        hinges = self.q[7:]
        outside = (hinges < self._low) | (hinges > self._high)
        if outside.any():
            self.within(self.q)
            self.velocity[FREE_DOFS:][outside] = 0.0
        keep = float(np.exp(-dt / VELOCITY_MEMORY_S))
        self.velocity *= keep
        self._uncorrected_s += dt
        np.clip(self._lively, *LIVELY_RANGE, out=self._density)
        self._density *= self._usual_density
        self._density[self._twists.dofs] *= self._twists.freedom(self.q) ** 2
        gain = move_on(self.covariance, self._density, self._rest_rate, dt, keep)
        self.q[7:] -= gain * (self.q[7:] - self._humanoid.rest_q)
        self._before = (*before, dt, keep)

    def toward(self, late_s: float) -> tuple[Array, Array]:
        """Covariance of the state with the configuration `late_s` [s] later, shape (2 nv, nv), and the process noise
        that the interval adds to that configuration, shape (nv,).
        """
        nv = self._model.nv
        with_later = self.covariance[:, :nv] + late_s * self.covariance[:, nv:]
        return with_later, self._density * (abs(late_s) ** 3 / 3.0)

    def earlier(self) -> tuple[Array, Array, Array]:
        """Smoothed configuration, shape (nq,), and velocity, (nv,), before the last prediction, given the corrections
        since; and the covariance of the configuration without them, shape (nv, nv).

        Source: Rauch, Tung, Striebel, "Maximum likelihood estimates of linear dynamic systems", AIAA J. 3, 1965.
        """
        if self._before is None:
            return self.q.copy(), self.velocity.copy(), self.place
        q, velocity, covariance, dt, keep = self._before
        nv = self._model.nv
        place, speed = self._told[:nv], self._told[nv:]
        step = covariance @ np.concatenate([place, dt * place + keep * speed])
        mujoco.mj_integratePos(self._model, q, np.clip(step[:nv], -LONGEST_BACK, LONGEST_BACK), 1.0)
        return self.within(q), velocity + step[nv:], covariance[:nv, :nv]

    def correct(self, step: Array, told: Array, gained: Array) -> None:
        """Apply a step of configuration and velocity, shape (2 nv,), from the information in `told`
        (`Correction.told`). The covariance falls by `gained`, its lower triangle.
        """
        nv = self._model.nv
        self._told += told
        mujoco.mj_integratePos(self._model, self.q, step[:nv], 1.0)
        self.within(self.q)
        self.velocity += step[nv:]
        expected = gained[self._speeds, self._speeds]
        corrected = np.minimum(step[nv:] ** 2 / (expected + LEAST_VARIANCE), MOST_CORRECTED**2)
        self._lively -= np.expm1(-self._uncorrected_s / LIVELY_S) * (corrected - self._lively)
        self._uncorrected_s = 0.0
        lessen(self.covariance, gained)

    def put(self, q: Array, hinges: NDArray[np.int64]) -> None:
        """Set some hinges to those of a configuration, with zero velocity, also in the state before the last
        prediction."""
        self.q = q
        dofs = FREE_DOFS + hinges
        self.velocity[dofs] = 0.0
        if self._before is not None:
            earlier, velocity, covariance, *_ = self._before
            earlier[7 + hinges], velocity[dofs] = q[7 + hinges], 0.0
            for which in (self._places[dofs], self._speeds[dofs]):
                covariance[which], covariance[:, which] = 0.0, 0.0

    def doubt(self, dofs: NDArray[np.int64], place: float, speed: float) -> None:
        """Increase the uncertainty of some degrees of freedom by these standard deviations [rad] and [rad/s]."""
        self.covariance[self._places[dofs], self._places[dofs]] += place**2
        self.covariance[self._speeds[dofs], self._speeds[dofs]] += speed**2
