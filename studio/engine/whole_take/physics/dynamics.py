"""Dynamics of a trajectory of the humanoid: momentum, its rate, and the points that may bear on the floor."""

from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import NDArray

from studio.engine.model.human.kinematics import SitedModel
from studio.engine.whole_take.physics.points import FloorPoints

GRAVITY_M_S2 = 9.81


@dataclass(frozen=True)
class Dynamics:
    """Dynamics of a trajectory's frames; F frames, P floor points.

    Attributes:
        com: centre of mass [m], shape (F, 3).
        com_jacobian: by the tangent of the configuration, shape (F, 3, nv).
        spin: maps velocities of the tangent to angular momentum about the centre of mass, shape (F, 3, nv).
        force: external force on the body at the inner frames [N], shape (F - 2, 3).
        moment: external moment about the centre of mass at the inner frames [N m], shape (F - 2, 3).
        points: floor points [m], shape (F, P, 3).
        bodies: world rotations of the points' bodies, shape (F, P, 3, 3).
    """

    com: NDArray[np.float64]
    com_jacobian: NDArray[np.float64]
    spin: NDArray[np.float64]
    force: NDArray[np.float64]
    moment: NDArray[np.float64]
    points: NDArray[np.float64]


def body_mass_kg(humanoid: SitedModel) -> float:
    """The humanoid's mass."""
    return float(humanoid.model.body_mass.sum())


def dynamics(humanoid: SitedModel, q: NDArray[np.float64], dt: float, points: FloorPoints) -> Dynamics:
    """Return the dynamics of configurations, shape (F, nq), `dt` apart [s], by central differences.

    The rate of linear momentum is the mass times the second difference of the centre of mass. Angular momentum
    is computed halfway between frames, from their difference and the mean of both ends' inertia.
    """
    model = humanoid.model
    data = mujoco.MjData(model)
    frames, nv = len(q), model.nv
    com, com_jacobian = np.empty((frames, 3)), np.empty((frames, 3, nv))
    spin, places = np.empty((frames, 3, nv)), np.empty((frames, len(points.body_ids), 3))
    steps = np.empty((frames - 1, nv))
    for t in range(frames):
        data.qpos[:] = q[t]
        mujoco.mj_kinematics(model, data)
        mujoco.mj_comPos(model, data)
        mujoco.mj_jacSubtreeCom(model, data, com_jacobian[t], 1)
        mujoco.mj_angmomMat(model, data, spin[t], 1)
        com[t] = data.subtree_com[1]
        rotations = data.xmat[points.body_ids].reshape(-1, 3, 3)
        places[t] = data.xpos[points.body_ids] + np.matvec(rotations, points.offsets_m)
        if t:
            mujoco.mj_differentiatePos(model, steps[t - 1], dt, q[t - 1], q[t])
    mass = body_mass_kg(humanoid)
    rise = np.array([0.0, 0.0, GRAVITY_M_S2])
    force = mass * ((com[2:] - 2.0 * com[1:-1] + com[:-2]) / dt**2 + rise)
    momentum = np.matvec(0.5 * (spin[1:] + spin[:-1]), steps)
    return Dynamics(com, com_jacobian, spin, force, np.diff(momentum, axis=0) / dt, places)
