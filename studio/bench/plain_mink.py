"""What the solvers are compared with: mink as its documentation shows it, one FrameTask per joint."""

import mink
import numpy as np
from numpy.typing import NDArray

from studio.engine.human.model import Humanoid
from studio.engine.joints import CANONICAL

ITERATIONS = 2
"""As many as the studio's own mink solve."""

DAMPING = 1e-3


class PlainMink:
    """Follows joints with one FrameTask per joint and the model's limits."""

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
