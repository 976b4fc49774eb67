"""Torques that a robot's motion needs: inverse dynamics, with the forces of the floor under its soles.

The forces are those that best explain the motion, within friction cones (`whole_take.physics.forces`).
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from studio.engine.robots.body.robot import Robot
from studio.engine.robots.moving.targets import SOLES
from studio.engine.whole_take.finish.trajectory import steps
from studio.engine.whole_take.physics.dynamics import Dynamics, dynamics
from studio.engine.whole_take.physics.forces import ARM_M, ContactForces, contact_forces, effects_at_points
from studio.engine.whole_take.physics.points import FloorPoints
from studio.engine.whole_take.physics.torques import InverseDynamics

Array = NDArray[np.float64]

BEARS_M, SOFT_M, SOFTEST = 0.02, 0.005, 1e-4
"""Height of a sole's corner below which it bears, half the height over which its firmness falls, and the least
firmness. So forces pass from corner to corner gradually, as under a soft sole, not from frame to frame."""

LEAST = 1e-6
"""Least eigenvalue of the effects of forces."""

KEPT_SHARE = 0.9
"""Share of a limit that a solve uses as the limit."""


def firmness(height_m: Array) -> Array:
    """Return how firmly corners of soles bear at heights over the floor, 0..1, same shape."""
    share = (height_m - (BEARS_M - SOFT_M)) / (2.0 * SOFT_M)
    return np.where(share < 1.0, SOFTEST ** np.clip(share, 0.0, 1.0), 0.0)


@dataclass(frozen=True)
class Strain:
    """Load of a robot's hinges at the inner frames of a motion.

    Attributes:
        q: the whole configurations, shape (frame_count, nq).
        soles_m: corners of the soles, shape (frame_count, 8, 3).
        firm: how firmly corners of the soles bear, 0..1, shape (frame_count - 2, 8).
        forces: of the floor.
        shares: torques as shares of their limits, 0 without a limit, shape (frame_count - 2, hinge_count).
        needed: the same with forces of the floor that may also pull; above 1 where the centre of pressure is outside
            the sole.
    """

    q: Array
    soles_m: Array
    firm: Array
    forces: ContactForces
    shares: Array
    needed: Array


class RobotTorques:
    """Torques of a robot's motions, frames `frame_s` apart [s]."""

    def __init__(self, robot: Robot, frame_s: float) -> None:
        sites = robot.site_ids[SOLES.ravel()]
        self._robot, self._frame_s = robot, frame_s
        self._points = FloorPoints(
            robot.model.site_bodyid[sites].astype(np.int64), robot.model.site_pos[sites], np.zeros(len(sites))
        )
        self._inverse = InverseDynamics(robot, self._points, frame_s)
        self.given = bool(np.isfinite(robot.torque_nm).any())
        """Whether any hinge has a limit."""

    def strain(self, q: Array) -> Strain:
        """Return the load of the hinges in whole configurations, shape (frame_count, nq)."""
        motion = dynamics(self._robot, q, self._frame_s, self._points)
        firm = firmness(motion.points[1:-1, :, 2])
        forces = contact_forces(motion, firm, shared=True)
        torque = self._inverse.torques(q, steps(q), forces)
        any_forces = replace(forces, at_points=_any_forces(motion, firm))
        needed = self._inverse.torques(q, steps(q), any_forces)
        return Strain(q, motion.points, firm, forces, self._of_limits(torque), self._of_limits(needed))

    def _of_limits(self, torque: Array) -> Array:
        """Torques [N m] as shares of their limits."""
        low, high = self._robot.torque_nm.T
        return np.maximum(torque / low, torque / high)


def _any_forces(motion: Dynamics, firm: Array) -> Array:
    """The least forces at corners, pulling or pushing, that explain a motion [N], shape (frame_count - 2, 8, 3)."""
    frames, count = firm.shape
    effects = effects_at_points(motion, np.eye(3)) * firm[..., None, None]
    effects = effects.reshape(frames, -1, 6)
    square = np.matmul(effects.swapaxes(1, 2), effects) + LEAST * np.eye(6)
    wanted = np.hstack([motion.force, motion.moment / ARM_M])
    forces = np.matmul(effects, np.linalg.solve(square, wanted[..., None])).reshape(frames, count, 3)
    return firm[..., None] * forces
