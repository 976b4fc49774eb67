"""The body's measures in the T-pose, used by all of its parts."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from studio.engine.model.joints import CANONICAL, INDEX, PARENTS
from studio.simulator.body.performers import Actor

Array = NDArray[np.float64]
SIDES: tuple[tuple[str, float], ...] = (("left", 1.0), ("right", -1.0))
_ADULT_HEAD_JOINT_M = 1.59
"""Height of the skull's base, adult of scale 1."""


@dataclass(frozen=True)
class Frame:
    """A performer's joints in the T-pose.

    Attributes:
        performer: the performer's parameters.
        joints_m: joint centres, stage frame, floor at z = 0, shape (21, 3).
    """

    performer: Actor
    joints_m: Array

    @staticmethod
    def of(performer: Actor, offsets_m: Array) -> "Frame":
        """Return the frame for T-pose offsets [m], shape (21, 3); see `CanonicalMotion`."""
        joints = np.zeros((len(CANONICAL), 3))
        for i, parent in enumerate(PARENTS):
            joints[i] = offsets_m[i] if parent < 0 else joints[parent] + offsets_m[i]
        return Frame(performer, joints)

    def joint(self, name: str) -> Array:
        """Return a joint's position [m], shape (3,)."""
        return self.joints_m[INDEX[name]]

    def middle(self, joint: str) -> Array:
        """Return the midpoint of the left and the right joint [m], shape (3,)."""
        return 0.5 * (self.joint(f"left_{joint}") + self.joint(f"right_{joint}"))

    @cached_property
    def scale(self) -> float:
        """Size relative to an adult of about 1.75 m."""
        return float(self.joint("head")[2]) / _ADULT_HEAD_JOINT_M

    @cached_property
    def breadth(self) -> float:
        """Breadth of the trunk relative to an adult's: mean of body scale and shoulder width."""
        shoulders = float(self.joint("left_shoulder")[0] - self.joint("right_shoulder")[0])
        return 0.5 * self.scale + 0.5 * shoulders / 0.36
