"""Joint torques by inverse dynamics under contact forces, and their excess over the joints' bounds."""

import mujoco
import numpy as np
from numpy.typing import NDArray

from studio.engine.model.human.humanoid import FREE_DOFS
from studio.engine.model.human.kinematics import SitedModel
from studio.engine.whole_take.physics.blocks import Blocks
from studio.engine.whole_take.physics.forces import ContactForces
from studio.engine.whole_take.physics.points import FloorPoints


def excess(torque: NDArray[np.float64], bounds: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return torques, shape (..., hinges), beyond their bounds, shape (hinges, 2), signed [N m]."""
    return torque - np.clip(torque, *bounds.T)


class InverseDynamics:
    """Torques of a body's trajectories, frames `dt` apart [s]."""

    def __init__(self, humanoid: SitedModel, points: FloorPoints, dt: float) -> None:
        self._model, self._data = humanoid.model, mujoco.MjData(humanoid.model)
        self._points, self._dt = points, dt

    def torques(
        self, q: NDArray[np.float64], steps: NDArray[np.float64], forces: ContactForces
    ) -> NDArray[np.float64]:
        """Return the torques of configurations, shape (F, nq), at the inner frames [N m], shape (F - 2, hinges).

        Args:
            q: the configurations.
            steps: tangent steps from each to the next, shape (F - 1, nv).
            forces: at the inner frames.
        """
        model, data = self._model, self._data
        velocity = 0.5 * (steps[1:] + steps[:-1]) / self._dt
        acceleration = np.diff(steps, axis=0) / self._dt**2
        torque = np.empty((len(velocity), model.nv))
        jacobian = np.empty((3, model.nv))
        for k in range(len(velocity)):
            self._place(q[k + 1])
            data.qvel[:], data.qacc[:] = velocity[k], acceleration[k]
            mujoco.mj_comVel(model, data)
            mujoco.mj_rne(model, data, 1, torque[k])
            for point in np.flatnonzero(forces.at_points[k].any(axis=1)):
                body = int(self._points.body_ids[point])
                place = data.xpos[body] + data.xmat[body].reshape(3, 3) @ self._points.offsets_m[point]
                mujoco.mj_jac(model, data, jacobian, None, place, body)
                torque[k] -= forces.at_points[k, point] @ jacobian
        return torque[:, FREE_DOFS:]

    def add_rows(
        self, blocks: Blocks, q: NDArray[np.float64], beyond: NDArray[np.float64], sigma_nm: float
    ) -> None:
        """Add a row with Cauchy costs for every hinge and frame with a torque `beyond` its bounds (`excess`); forces
        count as constant."""
        model, data = self._model, self._data
        inertia = np.empty((model.nv, model.nv))
        for k in np.flatnonzero(beyond.any(axis=1)):
            self._place(q[k + 1])
            mujoco.mj_makeM(model, data)
            mujoco.mj_fullM(model, data, inertia)
            hinges = np.flatnonzero(beyond[k])
            left = beyond[k, hinges] / sigma_nm
            weight = 1.0 / (1.0 + left**2)
            rows = inertia[FREE_DOFS + hinges] / (sigma_nm * self._dt**2)
            square = (weight[:, None] * rows).T @ rows
            pull = (weight * left) @ rows
            _add_difference(blocks, int(k), square, pull)

    def _place(self, q: NDArray[np.float64]) -> None:
        self._data.qpos[:] = q
        mujoco.mj_kinematics(self._model, self._data)
        mujoco.mj_comPos(self._model, self._data)


def _add_difference(
    blocks: Blocks, first: int, square: NDArray[np.float64], pull: NDArray[np.float64]
) -> None:
    """Add rows of the second difference of three frames, the first one at `first`: their square, shape (nv, nv), and
    their product with the residuals, shape (nv,)."""
    for frame, factor in ((first, 1.0), (first + 1, -2.0), (first + 2, 1.0)):
        blocks.diagonal[frame] += factor**2 * square
        blocks.right[frame] -= factor * pull
    blocks.next[first : first + 2] -= 2.0 * square
    blocks.second[first] += square
