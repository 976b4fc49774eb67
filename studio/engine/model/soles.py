"""Height of the soles: they are on the floor in the T-pose, so the root's height there gives their depth below each
joint.

A performer's own heights are measured where he stands (`calibration.soles`) and stored with his proportions and with
the poses of his solves. Other skeletons have their lowest joint, the ball of the foot, at a usual height.
"""

import numpy as np
from numpy.typing import ArrayLike

USUAL_TOE_HEIGHT_M = 0.02
"""Usual height of the lowest joint over the floor in the T-pose."""

TOE_HEIGHTS_M = (0.0, 0.12)
"""Accepted heights of the lowest joint."""


def rest_lift_m(heights_m: ArrayLike, root_height_m: float | None) -> float:
    """Return the lift that puts a T-pose on the floor at 0 [m].

    Args:
        heights_m: of its joints [m], shape (joint_count,), the root first.
        root_height_m: of the root over the floor, where known. A value that puts the lowest joint under the floor, or
            far above it, belongs to another body and is ignored.
    """
    heights = np.asarray(heights_m, dtype=np.float64)
    lowest = float(heights.min())
    if root_height_m is not None:
        lift = root_height_m - float(heights[0])
        if TOE_HEIGHTS_M[0] <= lowest + lift <= TOE_HEIGHTS_M[1]:
            return lift
    return USUAL_TOE_HEIGHT_M - lowest
