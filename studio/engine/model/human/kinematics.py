"""Joint positions of a configuration and their Jacobian, without allocation.

A point's velocity is the sum over its body's degrees of freedom: v = lin + rot x (p - c), with MuJoCo's `cdof` rows
(rot, lin) about the centre of mass c of the whole body (Featherstone, "Rigid body dynamics algorithms", 2008,
section 2.2). For all points and degrees of freedom this is one product of a (3 points, 6) and a (6, nv) matrix. A
mask keeps the degrees of freedom between the hips and each point.
"""

from typing import Protocol

import mujoco
import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


class SitedModel(Protocol):
    """A body on a free base whose points are sites: a human's joints, or a robot's points."""

    @property
    def model(self) -> mujoco.MjModel: ...
    @property
    def site_ids(self) -> NDArray[np.int64]: ...


class SiteKinematics:
    """Positions of the canonical joints and their Jacobian at a configuration.

    Attributes:
        data: MuJoCo data of the last configuration, or the data last given to `read`.
        positions: canonical joints in the stage frame [m], shape (21, 3).
        jacobian: their derivative by the tangent step (hips along the stage's axes and about their own, then one
            angle per hinge), shape (63, nv): three rows per joint.

    The next call overwrites `positions` and `jacobian`.
    """

    def __init__(self, humanoid: SitedModel) -> None:
        self._model, self._sites = humanoid.model, humanoid.site_ids
        self.data = mujoco.MjData(humanoid.model)
        count = len(humanoid.site_ids)
        self.positions = np.zeros((count, 3))
        self.jacobian = np.zeros((3 * count, humanoid.model.nv))
        self._mask = np.repeat(moving_dofs(humanoid), 3, axis=0).astype(np.float64)
        self._arms = np.zeros((count, 3, 6))  # maps rot to -(p - c) x rot, lin to lin
        self._arms[:, :, 3:] = np.eye(3)
        self._offsets = np.zeros((count, 3))

    def place(self, q: Array) -> Array:
        """Set a configuration, shape (nq,), and return the joints' positions, shape (21, 3)."""
        self.data.qpos[:] = q
        mujoco.mj_kinematics(self._model, self.data)
        return self._positions_of(self.data)

    def linearise(self, q: Array) -> tuple[Array, Array]:
        """Set a configuration, shape (nq,), and return `positions` and `jacobian`."""
        self.data.qpos[:] = q
        mujoco.mj_kinematics(self._model, self.data)
        mujoco.mj_comPos(self._model, self.data)
        return self.read(self.data)

    def read(self, data: mujoco.MjData) -> tuple[Array, Array]:
        """Return `positions` and `jacobian` of data on which `mj_kinematics` and `mj_comPos` were run."""
        offsets = np.subtract(self._positions_of(data), data.subtree_com[1], out=self._offsets)
        x, y, z = offsets.T
        arms = self._arms
        arms[:, 0, 1], arms[:, 0, 2] = z, -y
        arms[:, 1, 2], arms[:, 1, 0] = x, -z
        arms[:, 2, 0], arms[:, 2, 1] = y, -x
        np.matmul(arms.reshape(-1, 6), data.cdof.T, out=self.jacobian)
        self.jacobian *= self._mask
        return self.positions, self.jacobian

    def _positions_of(self, data: mujoco.MjData) -> Array:
        return data.site_xpos.take(self._sites, axis=0, out=self.positions, mode="clip")


def moving_dofs(humanoid: SitedModel) -> NDArray[np.bool_]:
    """Return which degrees of freedom move each canonical joint, shape (21, nv)."""
    model = humanoid.model
    moves = np.zeros((len(humanoid.site_ids), model.nv), dtype=bool)
    for row, site in enumerate(humanoid.site_ids):
        body = int(model.site_bodyid[site])
        while body > 0:
            first = int(model.body_dofadr[body])
            moves[row, first : first + int(model.body_dofnum[body])] = True
            body = int(model.body_parentid[body])
    return moves
