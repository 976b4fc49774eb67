"""The objective of mink: all joints' distances as one stacked task, and the pull of a motion prior."""

import mink
import mujoco
import numpy as np
from mink.tasks import BaseTask, Objective, Task
from numpy.typing import NDArray

from studio.engine.model.human.humanoid import FREE_DOFS, Humanoid
from studio.engine.model.human.kinematics import SitedModel, SiteKinematics

MAX_ERROR_M = 1.0
"""Distances are clipped at this length; beyond it the linear model does not hold."""


class JointPositionsTask(Task):
    """Moves the sites of the canonical joints to their targets, three rows per joint.

    One task with all rows costs less than half of a task per joint, because mink assembles each task's matrices in
    Python. A joint of weight 0 has no effect.
    """

    def __init__(self, humanoid: SitedModel, pull_scale: NDArray[np.float64] | None = None) -> None:
        """`pull_scale`: share of each joint's pull on each degree of freedom, shape (21, nv); None = all."""
        super().__init__(cost=np.zeros(3 * len(humanoid.site_ids)))
        self._pull_scale = None if pull_scale is None else np.repeat(pull_scale, 3, axis=0)
        self._kinematics = SiteKinematics(humanoid)
        self._sites = humanoid.site_ids
        self._targets = np.zeros((len(self._sites), 3))

    def set_targets(self, targets: NDArray[np.float64], weights: NDArray[np.float64]) -> None:
        """Set the joints' targets.

        Args:
            targets: shape (21, 3) [m], stage frame; NaN only where the weight is 0.
            weights: 1 / standard deviation [1/m], shape (21,); 0 = not used.
        """
        self._targets = np.where(weights[:, None] > 0, targets, 0.0)
        self.cost = np.repeat(weights, 3)

    def compute_error(self, configuration: mink.Configuration) -> NDArray[np.float64]:
        """Site positions minus targets [m], each clipped at `MAX_ERROR_M`, shape (63,)."""
        error = configuration.data.site_xpos.take(self._sites, axis=0)
        error -= self._targets
        squared = np.vecdot(error, error)
        if squared.max() > MAX_ERROR_M**2:
            error *= (MAX_ERROR_M / np.sqrt(np.maximum(squared, MAX_ERROR_M**2)))[:, None]
        return error.ravel()

    def compute_jacobian(self, configuration: mink.Configuration) -> NDArray[np.float64]:
        """Positions' Jacobian, shape (63, nv), with each joint's `pull`; overwritten by the next call."""
        _, jacobian = self._kinematics.read(configuration.data)
        if self._pull_scale is not None:
            jacobian *= self._pull_scale
        return jacobian


class MotionPriorTask(BaseTask):
    """Pulls the configuration towards a predicted one and a resting one, with a stiffness for each hinge.

    Minimises sum_k stiffness_k (q_k + dq_k - predicted_k)^2 + rest_stiffness_k (q_k + dq_k - rest_k)^2.
    """

    def __init__(self, humanoid: Humanoid) -> None:
        self._model = humanoid.model
        nv = humanoid.model.nv
        self.predicted = humanoid.rest_qpos
        self.stiffness = np.zeros(nv)
        self.rest_hinges = humanoid.rest_q
        self.rest_stiffness = np.zeros(nv - FREE_DOFS)
        self._difference = np.zeros(nv)
        self._H = np.zeros((nv, nv))

    def compute_qp_objective(self, configuration: mink.Configuration) -> Objective:
        """H and c of the two pulls; H is diagonal, and overwritten by the next call."""
        q = configuration.data.qpos
        mujoco.mj_differentiatePos(self._model, self._difference, 1.0, self.predicted, q)
        diagonal = self._H.reshape(-1)[:: len(self._H) + 1]
        diagonal[:] = self.stiffness
        diagonal[FREE_DOFS:] += self.rest_stiffness
        c = self.stiffness * self._difference
        c[FREE_DOFS:] += self.rest_stiffness * (q[FREE_DOFS + 1 :] - self.rest_hinges)
        return Objective(self._H, c)


class HingeLimit(mink.limits.Limit):
    """Keeps every hinge within its range, and every step within `max_step_rad`.

    mink's ConfigurationLimit allocates its matrices at every call; this class allocates them once.
    """

    def __init__(self, humanoid: Humanoid, max_step_rad: float, *, limited: bool = True) -> None:
        hinges = humanoid.model.nv - FREE_DOFS
        pick = np.eye(humanoid.model.nv)[FREE_DOFS:]
        self._G = np.vstack([pick, -pick])
        self._h = np.empty(2 * hinges)
        low, high = humanoid.range_rad.T if limited else np.full((2, hinges), np.inf) * [[-1.0], [1.0]]
        self._ends = np.concatenate([high, -low])
        self._signs = np.repeat([1.0, -1.0], hinges)
        self._max_step_rad = max_step_rad

    def compute_qp_inequalities(self, configuration: mink.Configuration, dt: float) -> mink.limits.Constraint:
        """G dq <= h, where h is `room`."""
        return mink.limits.Constraint(G=self._G, h=self.room(configuration))

    def room(self, configuration: mink.Configuration) -> NDArray[np.float64]:
        """Return each hinge's room to turn up, then down [rad], shape (2 * hinge_count,); overwritten by the next
        call."""
        q = configuration.data.qpos[FREE_DOFS + 1 :]
        hinges, h = len(q), self._h
        h[:hinges], h[hinges:] = q, q
        h *= self._signs
        np.subtract(self._ends, h, out=h)
        np.maximum(h, 0.0, out=h)
        np.minimum(h, self._max_step_rad, out=h)
        return h
