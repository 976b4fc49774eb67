"""Relax pose: the solved pose blended with the middle of each joint's range (Ménard 2014, 5.3: 10 % relaxed)."""

import mujoco
import numpy as np
from numpy.typing import NDArray

from studio.engine.model.human.humanoid import Humanoid

_FEET = ("left_ankle", "left_toe", "right_ankle", "right_toe")


class RelaxPose:
    """Moves each hinge by the share `weight` (0..1) towards the middle of its range.

    The middle of the knees' range is a bend, which shortens the legs. The hips sink until the lower foot is as high
    as it was; nothing else moves them.
    """

    def __init__(self, humanoid: Humanoid, weight: float) -> None:
        self._humanoid, self._weight = humanoid, weight
        self._middle = humanoid.range_rad.mean(axis=1)
        self._data = mujoco.MjData(humanoid.model)
        self._feet = [humanoid.model.site(name).id for name in _FEET]

    def apply(self, q: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the configuration, shape (nq,), relaxed."""
        out = q.copy()
        out[7:] = (1.0 - self._weight) * q[7:] + self._weight * self._middle
        out[2] += self._lowest_foot_m(q) - self._lowest_foot_m(out)
        return out

    def _lowest_foot_m(self, q: NDArray[np.float64]) -> float:
        self._data.qpos[:] = q
        mujoco.mj_kinematics(self._humanoid.model, self._data)
        return float(self._data.site_xpos[self._feet, 2].min())
