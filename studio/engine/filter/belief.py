"""What is known of the body: configuration, velocity, and how sure both are; and how it moves on its own."""

import mujoco
import numpy as np
from numpy.typing import NDArray

from studio.engine.filter.kernels import lessen, move_on
from studio.engine.human.model import BODY_JOINTS, FREE_DOFS, Humanoid
from studio.engine.human.ranges import dofs_of
from studio.engine.solve.twist import LimbTwists

Array = NDArray[np.float64]

REFERENCE_S = 1.0 / 30.0
"""Accelerations below are those of an interval this long; the density over time follows from it."""

VELOCITY_MEMORY_S = 0.2
"""A velocity decays over this time."""

REST_PER_S = 1.0
"""Pull to the resting stance, in units of each hinge's usual spread: it settles what no joint shows."""

LIVELY_S = 0.6
LIVELY_RANGE = (0.3, 3.0)
"""How much a degree of freedom accelerates, as variance against what is usual: within this range, what its velocity
was corrected by over this time against what was to be expected. Source: covariance matching (Mehra, "Approaches to
adaptive filtering", IEEE Trans. Automatic Control 17, 1972)."""

MOST_CORRECTED = 5.0
LEAST_VARIANCE = 1e-12
"""One correction counts as no more than so many of its deviations; a variance under the second [(rad/s)2] is none."""

LONGEST_BACK = 0.3
"""What is learned later moves a degree of freedom by no more than this [m, rad]."""

START_SIGMA = 0.1
START_VELOCITY_SIGMA = 2.0
"""Deviations at the start [m, rad] and [m/s, rad/s]."""

# Deviation of accelerations [m/s2, rad/s2] by output joint, the free hips first.
_HIPS = (11.0, 11.0, 14.0, 26.0, 26.0, 26.0)
_OF_HINGE = {"ForeArm_twist": 24.0, "Foot_turn": 14.0}
_ACCELERATION = {
    "Spine": 14.0, "Spine1": 14.0, "Spine2": 14.0, "Neck": 22.0, "Head": 22.0, "Shoulder": 22.0, "Arm": 48.0,
    "ForeArm": 60.0, "Hand": 24.0, "UpLeg": 42.0, "Leg": 60.0, "Foot": 30.0, "ToeBase": 24.0,
}  # fmt: skip


def acceleration_density(freedom: Array) -> Array:
    """Return the spectral density of each degree of freedom's acceleration [rad2/s3], shape (nv,).

    Args:
        freedom: how freely each moves, 1 = as usual, shape (nv,).
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
        """Begin anew at a configuration, standing still."""
        self.q = self.within(q.copy())
        self.velocity = np.zeros(self._model.nv)
        self._told, self._before = np.zeros(2 * self._model.nv), None
        self._lively[:], self._uncorrected_s = 1.0, 0.0
        self.covariance[:] = 0.0
        self.covariance[self._places, self._places] = START_SIGMA**2
        self.covariance[self._speeds, self._speeds] = START_VELOCITY_SIGMA**2

    def within(self, q: Array) -> Array:
        """Bring a configuration's hinges within their ranges, in place."""
        np.clip(q[7:], self._low, self._high, out=q[7:])
        return q

    def moved(self, dt: float) -> Array:
        """The configuration `dt` [s] later, were nothing to change."""
        q = self.q.copy()
        mujoco.mj_integratePos(self._model, q, self.velocity, dt)
        return self.within(q)

    def predict(self, dt: float) -> None:
        """Move on by `dt` [s]; hinges that nothing shows go to the resting stance, each measured weakly by itself."""
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
        """Covariance of the state with the configuration `late_s` [s] later, shape (2 nv, nv), and what the way
        there adds to that configuration's own, shape (nv,)."""
        nv = self._model.nv
        with_later = self.covariance[:, :nv] + late_s * self.covariance[:, nv:]
        return with_later, self._density * (abs(late_s) ** 3 / 3.0)

    def earlier(self) -> tuple[Array, Array, Array]:
        """Configuration, shape (nq,), and velocity, (nv,), before the last prediction, given what corrections have
        told since; and the covariance of the configuration without that, shape (nv, nv).

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
        """Move by a step of configuration and velocity, shape (2 nv,), that follows from what joints have `told`
        (`Correction.told`); the covariance falls by `gained`, its lower triangle."""
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
        """Put some hinges, which stand still then, where they are in a configuration; they are taken to have been
        there before the last prediction too."""
        self.q = q
        dofs = FREE_DOFS + hinges
        self.velocity[dofs] = 0.0
        if self._before is not None:
            earlier, velocity, covariance, *_ = self._before
            earlier[7 + hinges], velocity[dofs] = q[7 + hinges], 0.0
            for which in (self._places[dofs], self._speeds[dofs]):
                covariance[which], covariance[:, which] = 0.0, 0.0

    def doubt(self, dofs: NDArray[np.int64], place: float, speed: float) -> None:
        """Let some degrees of freedom be less sure, by these deviations [rad] and [rad/s]."""
        self.covariance[self._places[dofs], self._places[dofs]] += place**2
        self.covariance[self._speeds[dofs], self._speeds[dofs]] += speed**2
