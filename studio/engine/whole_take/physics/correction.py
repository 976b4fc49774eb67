"""Finishing's banded problem with rows of physics, solved a few more times from the finished take.

The added costs are the external force and moment that no contact explains, torques beyond the joints' strength, and
soles under the floor. The first have Cauchy costs, because an unknown chair or partner must not bend the motion.

Source: inverse dynamics with a residual at the root and friction cones as in Shum & Ho, "Real-time physical
modelling of character movements with Microsoft Kinect", VRST 2012; here for a whole take at once.
"""

from dataclasses import replace

import mujoco
import numpy as np
from numpy.typing import NDArray

from studio.engine.model.human.humanoid import Humanoid
from studio.engine.whole_take.finish.contact.contacts import Contacts
from studio.engine.whole_take.finish.measurements import Measurements
from studio.engine.whole_take.finish.smoother import Smoother
from studio.engine.whole_take.finish.trajectory import steps
from studio.engine.whole_take.physics.blocks import Blocks
from studio.engine.whole_take.physics.dynamics import GRAVITY_M_S2, Dynamics, body_mass_kg, dynamics
from studio.engine.whole_take.physics.forces import ARM_M, ContactForces, bearing, contact_forces
from studio.engine.whole_take.physics.points import SOLE_POINTS, floor_points
from studio.engine.whole_take.physics.strength import torque_bounds
from studio.engine.whole_take.physics.torques import InverseDynamics, excess

ITERATIONS = 3

RESIDUAL_SIGMA = 0.15
"""Standard deviation of the unexplained force, as a share of the body's weight; of the moment at `forces.ARM_M`."""

RESIDUAL_CAUCHY = 1.0
"""Normalised unexplained force from which the weight falls."""

EXPLAINED = 0.3
"""Weight of changes that contact forces could explain; it keeps the steps where the linear model holds."""

TORQUE_SIGMA_NM_KG = 0.5
"""Standard deviation of a torque beyond its bound, per kilogram of body mass."""

SUNK_SIGMA_M = 0.02
"""Standard deviation of a sole's point under the floor."""

FIRMLY = 4.0
"""Stiffness of standing feet relative to finishing, because a foot that bears weight does not slide."""


def floor_height_m(contacts: Contacts | None) -> float:
    """Return the height of the floor under a take before its lift."""
    return 0.0 if contacts is None else contacts.floor_m


class WindowStep(Smoother):
    """One step of a window towards a motion that fits cameras and physics; replaces `Smoother`."""

    def __init__(self, humanoid: Humanoid, dt: float, *, limited: bool = True) -> None:
        super().__init__(humanoid, dt, limited=limited)
        self._humanoid = humanoid
        self._points = floor_points(humanoid)
        self._mass_kg = body_mass_kg(humanoid)
        self._bounds = torque_bounds(self._mass_kg)
        self._inverse = InverseDynamics(humanoid, self._points, dt)
        self._data = mujoco.MjData(humanoid.model)

    def _normal(
        self, q: NDArray[np.float64], measurements: Measurements, contacts: Contacts | None
    ) -> Blocks:
        """Finishing's normal equations with the rows of physics."""
        firm = None if contacts is None else replace(contacts, hold=FIRMLY * contacts.hold)
        blocks = Blocks.of(self._equations(q, measurements, firm))
        floor_m = floor_height_m(contacts)
        self._add_dynamics(q, floor_m, blocks)
        self._add_floor(q, floor_m, blocks)
        return blocks

    def _add_dynamics(self, q: NDArray[np.float64], floor_m: float, blocks: Blocks) -> None:
        """Add rows for unexplained forces and moments, and for torques beyond their bounds."""
        motion = dynamics(self._humanoid, q, self._dt, self._points)
        bears = bearing(motion, self._points, floor_m)
        forces = contact_forces(motion, bears)
        sigma = RESIDUAL_SIGMA * self._mass_kg * GRAVITY_M_S2
        residual = forces.residual / sigma
        weight = 1.0 / np.sqrt(1.0 + (residual**2).sum(axis=1) / RESIDUAL_CAUCHY**2)
        seen = EXPLAINED * np.eye(6) + (1.0 - EXPLAINED) * forces.free
        seen *= weight[:, None, None] / sigma
        before, here, after = (seen @ jacobian for jacobian in self._wrench_jacobians(motion, forces))
        blocks.add_rows(before, here, after, residual * weight[:, None])
        torque = self._inverse.torques(q, steps(q), contact_forces(motion, bears, shared=True))
        self._inverse.add_rows(blocks, q, excess(torque, self._bounds), TORQUE_SIGMA_NM_KG * self._mass_kg)

    def _wrench_jacobians(
        self, motion: Dynamics, forces: ContactForces
    ) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
        """Jacobians of the residual by the frames before, at and after each inner frame, shape (F - 2, 6, nv).

        The inertia about the centre of mass counts as constant; the arms of the forces do not.
        """
        com, halfway = motion.com_jacobian, 0.5 * (motion.spin[1:] + motion.spin[:-1])
        linear = self._mass_kg / self._dt**2
        angular = 1.0 / (ARM_M * self._dt**2)
        push = forces.at_points.sum(axis=1) / ARM_M
        arm = -np.cross(push[:, None, :], com[1:-1].transpose(0, 2, 1)).transpose(0, 2, 1)
        both = halfway[1:] + halfway[:-1]
        return (
            np.concatenate([linear * com[:-2], angular * halfway[:-1]], axis=1),
            np.concatenate([-2.0 * linear * com[1:-1], arm - angular * both], axis=1),
            np.concatenate([linear * com[2:], angular * halfway[1:]], axis=1),
        )

    def _add_floor(self, q: NDArray[np.float64], floor_m: float, blocks: Blocks) -> None:
        """Add rows that raise points of soles under the floor."""
        model, data = self._humanoid.model, self._data
        bodies, offsets = self._points.body_ids[:SOLE_POINTS], self._points.offsets_m[:SOLE_POINTS]
        jacobian = np.empty((3, model.nv))
        for t, configuration in enumerate(q):
            data.qpos[:] = configuration
            mujoco.mj_kinematics(model, data)
            places = data.xpos[bodies] + np.matvec(data.xmat[bodies].reshape(-1, 3, 3), offsets)
            sunk = floor_m - places[:, 2]
            if sunk.max() <= 0.0:
                continue
            mujoco.mj_comPos(model, data)
            for point in np.flatnonzero(sunk > 0.0):
                mujoco.mj_jac(model, data, jacobian, None, places[point], int(bodies[point]))
                row = jacobian[2] / SUNK_SIGMA_M
                blocks.diagonal[t] += np.outer(row, row)
                blocks.right[t] += sunk[point] / SUNK_SIGMA_M * row
