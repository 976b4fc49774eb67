"""Jumps: joints that a restart moved, or that the images did not determine, stay unreliable for some frames."""

import numpy as np
from numpy.typing import NDArray

from studio.engine.seeing.fitting.confidence import LIMB_JOINTS
from studio.engine.seeing.search.bones import Untold

Array = NDArray[np.float64]

_KEPT = 0.93
"""Share of a jump that is kept per frame."""
_MOST_M = 0.2
"""Jumps are clipped at this [m], so that a restarted arm is not doubted for longer than a trunk."""
_UNTOLD_M = 0.1
"""Least expected error of a joint that the images do not determine [m]."""


class Jumps:
    """Recent jump of each joint.

    Two poses explain the same images of a body that is turned round or restarted, or whose first pose is hardly
    better than another. Its joints may be wrong by the distance between these poses, until some frames have not
    contradicted the later pose. Joints that the images did not determine are doubted for as long.

    Attributes:
        lately_m: jumps and doubts [m] that fade within about half a second, shape (joint_count,).
    """

    def __init__(self, joint_count: int) -> None:
        self.lately_m: Array = np.zeros(joint_count)

    def fade(self) -> None:
        """Fade all jumps by one frame."""
        self.lately_m *= _KEPT

    def told(self, before: Array, after: Array) -> None:
        """Add a change of pose: joints before and after [m], shape (joint_count, 3) each."""
        jump_m = np.linalg.norm(after - before, axis=1)
        self.lately_m = np.maximum(self.lately_m, np.minimum(jump_m, _MOST_M))

    def least_m(self, untold: Untold) -> Array:
        """Add the joints that an instant's images do not determine; return the least error of each joint [m], shape
        (joint_count,).
        """
        lately, now = LIMB_JOINTS[untold.lately], LIMB_JOINTS[untold.now]
        self.lately_m[lately] = np.maximum(self.lately_m[lately], _UNTOLD_M)
        out = self.lately_m.copy()
        out[now] = np.maximum(out[now], _UNTOLD_M)
        return out
