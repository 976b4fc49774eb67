"""Torques that a robot's motion takes: inverse dynamics, with the forces of the floor under its soles.

The forces are those that best explain the motion, within friction cones (`whole_take.physics.forces`).
"""

import mujoco
import numpy as np
from numpy.typing import NDArray

from studio.engine.robots.body.robot import Robot
from studio.engine.robots.free_joint import FREE_DOFS
from studio.engine.robots.moving.targets import SOLES
from studio.engine.whole_take.finish.trajectory import steps
from studio.engine.whole_take.physics.blocks import Blocks
from studio.engine.whole_take.physics.dynamics import dynamics
from studio.engine.whole_take.physics.forces import contact_forces
from studio.engine.whole_take.physics.points import FloorPoints
from studio.engine.whole_take.physics.torques import InverseDynamics, Torques, add_difference

Array = NDArray[np.float64]

BEARS_M = 0.02
"""A corner of a sole that is lower bears."""

KEPT_SHARE = 0.9
"""Share of a limit from which a solve keeps away."""

SIGMA_SHARE, HALF_SHARE = 0.1, 1.0
"""Standard deviation of a torque beyond that, and excess at which it counts half, as shares of its limit. Costs are
Cauchy's: what a robot cannot do at all must not bend the rest of its motion."""


class RobotTorques:
    """Torques of a robot's motions, frames `frame_s` apart [s]."""

    def __init__(self, robot: Robot, frame_s: float) -> None:
        sites = robot.site_ids[SOLES.ravel()]
        self._robot, self._frame_s = robot, frame_s
        self._points = FloorPoints(
            robot.model.site_bodyid[sites].astype(np.int64), robot.model.site_pos[sites], np.zeros(len(sites))
        )
        self._inverse = InverseDynamics(robot, self._points, KEPT_SHARE * robot.torque_nm, frame_s)
        self._data = mujoco.MjData(robot.model)
        self.given = bool(np.isfinite(robot.torque_nm).any())
        """Whether any hinge has a limit."""

    def shares(self, q: Array) -> Array:
        """Return torques as shares of their limits at the inner frames of configurations, shape (frame_count, nq).

        Returns:
            Shape (frame_count - 2, hinge_count); 0 where no limit is given.
        """
        return self._shares(self._of(q)[0])

    def _shares(self, torques: Torques) -> Array:
        low, high = self._robot.torque_nm.T
        return np.maximum(torques.torque / low, torques.torque / high)

    def _of(self, q: Array) -> tuple[Torques, Array]:
        """Torques, and forces at the points, shape (frame_count - 2, point_count, 3)."""
        motion = dynamics(self._robot, q, self._frame_s, self._points)
        bears = motion.points[1:-1, :, 2] < BEARS_M
        forces = contact_forces(motion, bears, shared=True)
        return self._inverse.torques(q, steps(q), forces), forces.at_points

    def add_rows(self, blocks: Blocks, q: Array, dofs: NDArray[np.int64]) -> float:
        """Add rows that bring torques back to `KEPT_SHARE` of their limits.

        The forces of the floor follow the accelerations: the least ones, at the points that bear, that move the base.

        Args:
            blocks: normal equations of the degrees of freedom `dofs`.
            q: whole configurations, shape (frame_count, nq).

        Returns:
            How far torques are beyond their limits, as shares of those: the mean over frames of the worst joint's.
        """
        torques, forces = self._of(q)
        limit = np.abs(self._robot.torque_nm).min(axis=1)
        sigma = SIGMA_SHARE * limit
        for k in np.flatnonzero(torques.excess.any(axis=1)):
            hinges = np.flatnonzero(torques.excess[k])
            excess = torques.excess[k, hinges]
            weight = 1.0 / (1.0 + (excess / (HALF_SHARE * limit[hinges])) ** 2)
            rows = self._by_acceleration(q[k + 1], np.flatnonzero(forces[k].any(axis=1)))[hinges][:, dofs]
            rows /= sigma[hinges, None] * self._frame_s**2
            square, pull = (weight[:, None] * rows).T @ rows, (weight * excess / sigma[hinges]) @ rows
            add_difference(blocks, int(k), square, pull)
        return float(np.maximum(self._shares(torques) - 1.0, 0.0).max(axis=1).mean())

    def _by_acceleration(self, q: Array, bearing: NDArray[np.int64]) -> Array:
        """Torques by accelerations of all degrees of freedom, shape (hinge_count, nv), where some points bear."""
        model, data = self._robot.model, self._data
        data.qpos[:] = q
        mujoco.mj_kinematics(model, data)
        mujoco.mj_comPos(model, data)
        mujoco.mj_makeM(model, data)
        inertia = np.empty((model.nv, model.nv))
        mujoco.mj_fullM(model, data, inertia)
        rows = inertia[FREE_DOFS:]
        if not len(bearing):
            return rows
        sites = self._robot.site_ids[SOLES.ravel()][bearing]
        ways = np.empty((len(sites), 3, model.nv))
        for way, site in zip(ways, sites, strict=True):
            mujoco.mj_jacSite(model, data, way, None, int(site))
        across = ways.reshape(-1, model.nv).T
        pushes = np.linalg.pinv(across[:FREE_DOFS], rcond=1e-3) @ inertia[:FREE_DOFS]
        return rows - across[FREE_DOFS:] @ pushes
