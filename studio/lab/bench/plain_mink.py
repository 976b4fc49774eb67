"""Baselines of the solvers: mink as in its documentation, one FrameTask per joint."""

import mink
import numpy as np
from numpy.typing import NDArray

from studio.engine.model.human.humanoid import Humanoid
from studio.engine.model.joints import CANONICAL

ITERATIONS = 2
"""Iterations, as in the studio's own mink solve."""

DAMPING = 1e-3


RETARGETING_DAMPING, RETARGETING_LM_DAMPING = 0.5, 1.0
RETARGETING_GAIN, RETARGETING_MOST = 1e-3, 10


class PlainMink:
    """Inverse kinematics with one FrameTask per joint and the model's limits."""

    def __init__(self, humanoid: Humanoid) -> None:
        self._configuration = mink.Configuration(humanoid.model, humanoid.rest_qpos)
        self._tasks = [
            mink.FrameTask(name, "site", position_cost=1.0, orientation_cost=0.0) for name in CANONICAL
        ]
        self._limits = [mink.ConfigurationLimit(humanoid.model)]

    def solve(self, joints: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the configuration, shape (nq,), that follows canonical joints [m], (21, 3); NaN = unseen."""
        tasks = []
        for task, joint in zip(self._tasks, joints, strict=True):
            if np.isfinite(joint).all():
                task.set_target(mink.SE3.from_translation(joint))
                tasks.append(task)
        for _ in range(ITERATIONS):
            step = mink.solve_ik(
                self._configuration, tasks, 1.0, "daqp", damping=DAMPING, limits=self._limits
            )
            self._configuration.integrate_inplace(step, 1.0)
        return self._configuration.q


class RetargetingMink:
    """Inverse kinematics with mink as in General Motion Retargeting: two tables of tasks, repeated while the error
    falls.

    Its settings, on this model with positions alone: DAQP, damping 0.5, Levenberg-Marquardt damping 1, the model's
    limits. Each table is solved once, and up to ten times more while its error's norm falls by more than 1e-3.

    Source: Araujo, Ze, et al., "Retargeting Matters: General Motion Retargeting for Humanoid Motion Tracking", 2025;
    the settings of its published program.
    """

    def __init__(self, humanoid: Humanoid) -> None:
        self._configuration = mink.Configuration(humanoid.model, humanoid.rest_qpos)
        self._timestep = float(humanoid.model.opt.timestep)
        self._limits = [mink.ConfigurationLimit(humanoid.model)]
        self._tables = [
            [
                mink.FrameTask(
                    name, "site", position_cost=cost, orientation_cost=0.0, lm_damping=RETARGETING_LM_DAMPING
                )
                for name in CANONICAL
            ]
            for cost in (10.0, 100.0)
        ]

    def solve(self, joints: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the configuration, shape (nq,), that follows canonical joints [m], (21, 3); NaN = unseen."""
        seen = np.logical_and.reduce(np.isfinite(joints), axis=1)
        for table in self._tables:
            tasks = [task for task, there in zip(table, seen, strict=True) if there]
            for task, joint in zip(tasks, joints[seen], strict=True):
                task.set_target(mink.SE3.from_translation(joint))
            error = self._error(tasks)
            for _ in range(1 + RETARGETING_MOST):
                step = mink.solve_ik(
                    self._configuration,
                    tasks,
                    self._timestep,
                    "daqp",
                    damping=RETARGETING_DAMPING,
                    limits=self._limits,
                )
                self._configuration.integrate_inplace(step, self._timestep)
                before, error = error, self._error(tasks)
                if before - error <= RETARGETING_GAIN:
                    break
        return self._configuration.q

    def _error(self, tasks: list[mink.FrameTask]) -> float:
        errors = [task.compute_error(self._configuration)[:3] for task in tasks]
        return float(np.linalg.norm(np.concatenate(errors))) if errors else 0.0
