"""Where the soles are: on the floor in the T-pose, so the root's height there says how far below each joint they lie.

A performer's own heights are measured where he stands (`calibration.soles`) and go with his proportions and with the
poses of his solves; a skeleton without them has its lowest joint, the ball of the foot, at a usual height.
"""

import numpy as np
from numpy.typing import ArrayLike

USUAL_TOE_HEIGHT_M = 0.02
"""Height of the lowest joint over the floor in the T-pose where nothing is known of it."""

TOE_HEIGHTS_M = (0.0, 0.12)
"""Heights of the lowest joint that are believed."""


def rest_lift_m(heights_m: ArrayLike, root_height_m: float | None) -> float:
    """Return how far a T-pose has to rise so that it stands on the floor at 0.

    Args:
        heights_m: of its joints [m], shape (joint_count,), the root first.
        root_height_m: of the root over the floor, where it is known; one that would put the lowest joint under the
            floor, or far above it, is of another body and is not believed.
    """
    heights = np.asarray(heights_m, dtype=np.float64)
    lowest = float(heights.min())
    if root_height_m is not None:
        lift = root_height_m - float(heights[0])
        if TOE_HEIGHTS_M[0] <= lowest + lift <= TOE_HEIGHTS_M[1]:
            return lift
    return USUAL_TOE_HEIGHT_M - lowest
