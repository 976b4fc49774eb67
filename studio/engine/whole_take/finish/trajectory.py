"""Joint positions and Jacobians of the humanoid over many frames."""

import mujoco
import numpy as np
from numpy.typing import NDArray

from studio.engine.base.quaternions import inverse, multiply, normalized
from studio.engine.model.human.humanoid import FREE_DOFS, Humanoid
from studio.engine.model.human.kinematics import moving_dofs


class Kinematics:
    """Canonical joints of many configurations of a humanoid, and their Jacobians."""

    def __init__(self, humanoid: Humanoid, pull: NDArray[np.float64] | None = None) -> None:
        """`pull`: each joint's share of influence on each degree of freedom, shape (21, nv); None = 1."""
        self._model, self._ids = humanoid.model, humanoid.site_ids
        self._data = mujoco.MjData(humanoid.model)
        moving = moving_dofs(humanoid) * (1.0 if pull is None else pull)
        self._mask = np.repeat(moving, 3, axis=0).astype(np.float64)

    def sites(self, q: NDArray[np.float64]) -> NDArray[np.float64]:
        """Canonical joints [m], shape (frame_count, 21, 3), of configurations, shape (frame_count, nq)."""
        out = np.empty((len(q), len(self._ids), 3))
        for t, configuration in enumerate(q):
            self._data.qpos[:] = configuration
            mujoco.mj_kinematics(self._model, self._data)
            self._data.site_xpos.take(self._ids, axis=0, out=out[t], mode="clip")
        return out

    def linearised(self, q: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Canonical joints [m], shape (frame_count, 21, 3), and their Jacobians, shape (frame_count, 63, nv);
        see `human.kinematics`."""
        data, model = self._data, self._model
        sites = np.empty((len(q), len(self._ids), 3))
        motion = np.empty((len(q), model.nv, 6))
        centre = np.empty((len(q), 1, 3))
        for t, configuration in enumerate(q):
            data.qpos[:] = configuration
            mujoco.mj_kinematics(model, data)
            mujoco.mj_comPos(model, data)
            data.site_xpos.take(self._ids, axis=0, out=sites[t], mode="clip")
            motion[t] = data.cdof
            centre[t] = data.subtree_com[1]
        jacobians = point_jacobians(sites - centre, motion)
        jacobians *= self._mask
        return sites, jacobians


def point_jacobians(arms: NDArray[np.float64], motion: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return Jacobians of points that every degree of freedom moves, shape (frame_count, 3 * point_count, nv).

    Args:
        arms: points from the centre of mass of the tree [m], shape (frame_count, point_count, 3).
        motion: MuJoCo's `cdof` of each frame, shape (frame_count, nv, 6).
    """
    x, y, z = np.moveaxis(arms, 2, 0)
    levers = np.zeros((*arms.shape, 6))
    levers[:, :, 0, 1], levers[:, :, 0, 2] = z, -y
    levers[:, :, 1, 2], levers[:, :, 1, 0] = x, -z
    levers[:, :, 2, 0], levers[:, :, 2, 1] = y, -x
    levers[:, :, range(3), range(3, 6)] = 1.0
    return np.matmul(levers.reshape(len(arms), -1, 6), motion.transpose(0, 2, 1))


def moved(q: NDArray[np.float64], step: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return configurations, shape (frame_count, nq), moved by tangent steps, shape (frame_count, nv)."""
    out = np.empty_like(q)
    out[:, :3] = q[:, :3] + step[:, :3]
    out[:, 7:] = q[:, 7:] + step[:, FREE_DOFS:]
    half = 0.5 * step[:, 3:6]
    angle = np.linalg.norm(half, axis=1, keepdims=True)
    turn = np.concatenate([np.cos(angle), half * np.sinc(angle / np.pi)], axis=1)
    out[:, 3:7] = normalized(multiply(q[:, 3:7], turn))
    return out


def steps(q: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the tangent steps from each frame to the next, shape (frame_count - 1, nv)."""
    return steps_between(q[:-1], q[1:])


def steps_between(a: NDArray[np.float64], b: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the tangent steps from configurations to others, frame by frame, shape (frame_count, nv)."""
    out = np.empty((len(a), a.shape[1] - 1))
    out[:, :3] = b[:, :3] - a[:, :3]
    out[:, FREE_DOFS:] = b[:, 7:] - a[:, 7:]
    turn = multiply(inverse(a[:, 3:7]), b[:, 3:7])
    turn *= np.where(turn[:, :1] < 0.0, -1.0, 1.0)
    sine = np.linalg.norm(turn[:, 1:], axis=1, keepdims=True)
    angle = 2.0 * np.arctan2(sine, turn[:, :1])
    out[:, 3:6] = turn[:, 1:] * np.where(sine > 1e-9, angle / np.maximum(sine, 1e-9), 2.0)
    return out
