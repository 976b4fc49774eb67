"""Finishing's banded problem with rows of physics, solved a few more times from the finished take.

To what the cameras tell and how joints usually accelerate come the external force and moment that no contact
explains (with Cauchy costs: what the model does not know, a chair or a partner, must not bend the motion), torques
beyond what joints can hold, and soles under the floor.

Source: inverse dynamics with a residual at the root and friction cones as in Shum & Ho, "Real-time physical
modelling of character movements with Microsoft Kinect", VRST 2012; here for a whole take at once.
"""

from dataclasses import replace

import mujoco
import numpy as np
from numpy.typing import NDArray

from studio.engine.finish.contacts import Contacts
from studio.engine.finish.measurements import Measurements
from studio.engine.finish.smoother import Smoother
from studio.engine.finish.trajectory import steps
from studio.engine.human.model import Humanoid
from studio.engine.physics.blocks import Blocks
from studio.engine.physics.dynamics import GRAVITY_M_S2, Dynamics, body_mass_kg, dynamics
from studio.engine.physics.forces import ARM_M, ContactForces, bearing, contact_forces
from studio.engine.physics.points import SOLE_POINTS, floor_points
from studio.engine.physics.strength import torque_bounds
from studio.engine.physics.torques import InverseDynamics

ITERATIONS = 3

RESIDUAL_SIGMA = 0.15
"""Deviation of the unexplained force, as a share of the body's weight; of the moment at `forces.ARM_M`."""

RESIDUAL_CAUCHY = 1.0
"""Unexplained forces beyond this many deviations count less and less."""

EXPLAINED = 0.3
"""Weight of changes that contact forces could follow: they keep the steps where the linear model holds."""

TORQUE_SIGMA_NM_KG = 0.5
"""Deviation of a torque beyond its bound, per kilogram of body mass."""

SUNK_SIGMA_M = 0.02
"""Deviation of a sole's point under the floor."""

FIRMLY = 4.0
"""Standing feet are held this much more firmly than in finishing: what bears does not slide."""


def floor_height_m(contacts: Contacts | None) -> float:
    """Return the height of the floor under a take that is not lifted yet."""
    return 0.0 if contacts is None else contacts.floor_m


class Correction(Smoother):
    """One step of a window towards a motion that cameras and physics agree on; takes the place of `Smoother`."""

    def __init__(self, humanoid: Humanoid, dt: float, *, limited: bool = True) -> None:
        super().__init__(humanoid, dt, limited=limited)
        self._humanoid = humanoid
        self._points = floor_points(humanoid)
        self._mass_kg = body_mass_kg(humanoid)
        self._inverse = InverseDynamics(humanoid, self._points, torque_bounds(self._mass_kg), dt)
        self._data = mujoco.MjData(humanoid.model)

    def _normal(
        self, q: NDArray[np.float64], measurements: Measurements, contacts: Contacts | None, **how: bool
    ) -> Blocks:
        """Finishing's normal equations with the rows of physics."""
        firm = None if contacts is None else replace(contacts, hold=FIRMLY * contacts.hold)
        blocks = Blocks.of(super()._normal(q, measurements, firm, **how))
        floor_m = floor_height_m(contacts)
        self._add_dynamics(q, floor_m, blocks)
        self._add_floor(q, floor_m, blocks)
        return blocks

    def _add_dynamics(self, q: NDArray[np.float64], floor_m: float, blocks: Blocks) -> None:
        """Unexplained forces and moments vanish, torques stay within their bounds."""
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
        torques = self._inverse.torques(q, steps(q), contact_forces(motion, bears, shared=True))
        self._inverse.add_rows(blocks, q, torques, TORQUE_SIGMA_NM_KG * self._mass_kg)

    def _wrench_jacobians(
        self, motion: Dynamics, forces: ContactForces
    ) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
        """Jacobians of the residual by the frames before, at and after each inner frame, shape (F - 2, 6, nv).

        The inertia about the centre of mass counts as constant, the arms of the forces do not.
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
        """Points of soles under the floor come up."""
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
