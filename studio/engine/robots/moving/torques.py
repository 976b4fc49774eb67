"""Torques that a robot's motion takes: inverse dynamics, with the forces of the floor under its soles.

The forces are those that best explain the motion, within friction cones (`whole_take.physics.forces`).
"""

import numpy as np
from numpy.typing import NDArray

from studio.engine.robots.body.robot import Robot
from studio.engine.robots.moving.targets import SOLES
from studio.engine.whole_take.finish.trajectory import steps
from studio.engine.whole_take.physics.dynamics import Dynamics, dynamics
from studio.engine.whole_take.physics.forces import ContactForces, contact_forces
from studio.engine.whole_take.physics.points import FloorPoints
from studio.engine.whole_take.physics.torques import InverseDynamics

Array = NDArray[np.float64]

BEARS_M = 0.02
"""A corner of a sole that is lower bears."""

KEPT_SHARE = 0.9
"""Share of a limit from which a solve keeps away."""


class RobotTorques:
    """Torques of a robot's motions, frames `frame_s` apart [s]."""

    def __init__(self, robot: Robot, frame_s: float) -> None:
        sites = robot.site_ids[SOLES.ravel()]
        self._robot, self._frame_s = robot, frame_s
        self._points = FloorPoints(
            robot.model.site_bodyid[sites].astype(np.int64), robot.model.site_pos[sites], np.zeros(len(sites))
        )
        self._inverse = InverseDynamics(robot, self._points, robot.torque_nm, frame_s)
        self.given = bool(np.isfinite(robot.torque_nm).any())
        """Whether any hinge has a limit."""

    def shares(self, q: Array) -> Array:
        """Return torques as shares of their limits at the inner frames of configurations, shape (frame_count, nq).

        Returns:
            Shape (frame_count - 2, hinge_count); 0 where no limit is given.
        """
        motion = self.dynamics(q)
        return self.of_limits(self.under(motion, q, motion.points[1:-1, :, 2] < BEARS_M)[0])

    def of_limits(self, torque: Array) -> Array:
        """Return torques [N m], shape (..., hinge_count), as shares of their limits."""
        low, high = self._robot.torque_nm.T
        return np.maximum(torque / low, torque / high)

    def dynamics(self, q: Array) -> Dynamics:
        """Return what moves the robot in whole configurations, shape (frame_count, nq)."""
        return dynamics(self._robot, q, self._frame_s, self._points)

    def under(self, motion: Dynamics, q: Array, bears: NDArray[np.bool_]) -> tuple[Array, ContactForces]:
        """Return torques [N m], shape (frame_count - 2, hinge_count), and the forces of the floor.

        Args:
            motion: dynamics of the configurations.
            q: the configurations.
            bears: which corners of the soles bear at the inner frames, shape (frame_count - 2, 8).
        """
        forces = contact_forces(motion, bears, shared=True)
        return self._inverse.torques(q, steps(q), forces).torque, forces
