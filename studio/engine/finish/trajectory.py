"""Joint positions and Jacobians of the humanoid over many frames."""

import mujoco
import numpy as np
from numpy.typing import NDArray

from studio.engine.human.model import Humanoid


class Trajectory:
    """Configurations over time, shape (frame_count, nq), and what follows from them."""

    def __init__(self, humanoid: Humanoid, q: NDArray[np.float64]) -> None:
        self._humanoid = humanoid
        self._data = mujoco.MjData(humanoid.model)
        self.q = q.copy()

    def sites(self) -> NDArray[np.float64]:
        """Canonical joints [m], shape (frame_count, 21, 3)."""
        model, data, ids = self._humanoid.model, self._data, self._humanoid.site_ids
        out = np.empty((len(self.q), len(ids), 3))
        for t, q in enumerate(self.q):
            data.qpos[:] = q
            mujoco.mj_kinematics(model, data)
            out[t] = data.site_xpos[ids]
        return out

    def linearised(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Canonical joints [m], shape (frame_count, 21, 3), and their Jacobians, shape (frame_count, 63, nv)."""
        model, data, ids = self._humanoid.model, self._data, self._humanoid.site_ids
        out = np.empty((len(self.q), len(ids), 3))
        jacobians = np.zeros((len(self.q), 3 * len(ids), model.nv))
        sites = [(3 * i, int(site)) for i, site in enumerate(ids)]
        for t, q in enumerate(self.q):
            data.qpos[:] = q
            mujoco.mj_kinematics(model, data)
            mujoco.mj_comPos(model, data)
            out[t] = data.site_xpos[ids]
            for row, site in sites:
                mujoco.mj_jacSite(model, data, jacobians[t, row : row + 3], None, site)
        return out, jacobians

    def step(self, dq: NDArray[np.float64], low: NDArray[np.float64], high: NDArray[np.float64]) -> None:
        """Move by tangent steps, shape (frame_count, nv), and keep hinges within (low, high)."""
        for t in range(len(self.q)):
            mujoco.mj_integratePos(self._humanoid.model, self.q[t], dq[t], 1.0)
        self.q[:, 7:] = np.clip(self.q[:, 7:], low, high)

    def velocities(self) -> NDArray[np.float64]:
        """Tangent steps from each frame to the next, shape (frame_count - 1, nv)."""
        out = np.empty((len(self.q) - 1, self._humanoid.model.nv))
        for t in range(len(out)):
            mujoco.mj_differentiatePos(self._humanoid.model, out[t], 1.0, self.q[t], self.q[t + 1])
        return out
