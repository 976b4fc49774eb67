"""What mink minimises: all joints' distances as one stacked task, and the pull of a motion prior."""

import mink
import mujoco
import numpy as np
from mink.tasks import BaseTask, Objective, Task
from numpy.typing import NDArray

from studio.engine.human.model import FREE_DOFS, Humanoid

MAX_ERROR_M = 1.0
"""A joint further than this from its target pulls no harder: beyond, the pose's linear model means nothing."""


class JointPositionsTask(Task):
    """Moves the sites of the canonical joints to their targets, three rows per joint.

    One task with all rows costs less than half of a task per joint: mink assembles each task's matrices in
    Python. A joint of weight 0 takes no part, and its Jacobian is not computed.
    """

    def __init__(self, humanoid: Humanoid, pull_scale: NDArray[np.float64] | None = None) -> None:
        """`pull_scale`: share of each joint's pull on each degree of freedom, shape (21, nv); None = all."""
        super().__init__(cost=np.zeros(3 * len(humanoid.site_ids)))
        self._pull_scale = None if pull_scale is None else np.repeat(pull_scale, 3, axis=0)
        self._site_ids = [int(i) for i in humanoid.site_ids]
        self._site_index = humanoid.site_ids
        self._jacobian = np.zeros((3 * len(self._site_ids), humanoid.model.nv))
        self._targets = np.zeros((len(self._site_ids), 3))
        self._active: list[int] = []

    def set_targets(self, targets: NDArray[np.float64], weights: NDArray[np.float64]) -> None:
        """Set where the joints should be.

        Args:
            targets: shape (21, 3) [m], stage frame; NaN only where the weight is 0.
            weights: 1 / expected deviation [1/m], shape (21,); 0 = no part.
        """
        used = weights > 0
        self._targets = np.where(used[:, None], targets, 0.0)
        self.cost = np.repeat(np.where(used, weights, 0.0), 3)
        self._active = [int(i) for i in np.flatnonzero(used)]

    def compute_error(self, configuration: mink.Configuration) -> NDArray[np.float64]:
        """Site positions minus targets [m], each at most `MAX_ERROR_M` long, shape (63,)."""
        error = configuration.data.site_xpos[self._site_index] - self._targets
        length = np.sqrt((error * error).sum(axis=1, keepdims=True))
        return (error * (MAX_ERROR_M / np.maximum(length, MAX_ERROR_M))).ravel()

    def compute_jacobian(self, configuration: mink.Configuration) -> NDArray[np.float64]:
        """Positions' Jacobian, shape (63, nv); rows of joints that take no part are stale and weigh nothing."""
        model, data, jacobian = configuration.model, configuration.data, self._jacobian
        for i in self._active:
            mujoco.mj_jacSite(model, data, jacobian[3 * i : 3 * i + 3], None, self._site_ids[i])
        return jacobian if self._pull_scale is None else jacobian * self._pull_scale


class MotionPriorTask(BaseTask):
    """Pulls the configuration towards a predicted one and a resting one, each hinge with its own strength.

    Minimises sum_k stiffness_k (q_k + dq_k - predicted_k)^2 + rest_stiffness_k (q_k + dq_k - rest_k)^2.
    """

    def __init__(self, humanoid: Humanoid) -> None:
        self._model = humanoid.model
        nv = humanoid.model.nv
        self.predicted = humanoid.rest_qpos
        self.stiffness = np.zeros(nv)
        self.rest = humanoid.rest_qpos
        self.rest_stiffness = np.zeros(nv)
        self._difference = np.zeros(nv)

    def compute_qp_objective(self, configuration: mink.Configuration) -> Objective:
        """H and c of the two pulls; both are diagonal."""
        q = configuration.data.qpos
        mujoco.mj_differentiatePos(self._model, self._difference, 1.0, self.predicted, q)
        c = self.stiffness * self._difference
        mujoco.mj_differentiatePos(self._model, self._difference, 1.0, self.rest, q)
        c += self.rest_stiffness * self._difference
        return Objective(np.diag(self.stiffness + self.rest_stiffness), c)


class HingeLimit(mink.limits.Limit):
    """Keeps every hinge within its range, and no step longer than `max_step_rad`.

    mink's ConfigurationLimit allocates its matrices at every call; here they are made once.
    """

    def __init__(self, humanoid: Humanoid, max_step_rad: float, *, limited: bool = True) -> None:
        hinges = humanoid.model.nv - FREE_DOFS
        pick = np.eye(humanoid.model.nv)[FREE_DOFS:]
        self._G = np.vstack([pick, -pick])
        self._h = np.empty(2 * hinges)
        self._low, self._high = humanoid.range_rad.T if limited else (-np.inf, np.inf)
        self._max_step_rad = max_step_rad

    def compute_qp_inequalities(self, configuration: mink.Configuration, dt: float) -> mink.limits.Constraint:
        """G dq <= h with h the distance to the ends."""
        q = configuration.data.qpos[FREE_DOFS + 1 :]
        hinges = len(q)
        np.clip(self._high - q, 0.0, self._max_step_rad, out=self._h[:hinges])
        np.clip(q - self._low, 0.0, self._max_step_rad, out=self._h[hinges:])
        return mink.limits.Constraint(G=self._G, h=self._h)
