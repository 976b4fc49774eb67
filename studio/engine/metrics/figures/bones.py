"""Variation of a solve's bone lengths; a human's are constant.

A bone goes from a joint of the solve to its parent, as `poses.npz` names them. Canonical joints are not enough:
from the hips to the spine they span two bones, and a bend between them would count as stretching.
"""

import numpy as np

from studio.engine.metrics.reference.matching import Matched

ARITHMETIC_MM = 1e-6
"""Deviation below which a bone is rigid, because the rest is rounding error."""


def bone_length_sd_mm(matched: Matched) -> float | None:
    """Standard deviation of each bone's length over the compared frames, as the mean over bones [mm].

    The bones are those of `Matched.bone_lengths_m`; exactly 0 for a rigid skeleton, None without a bone.
    """
    if not matched.bone_lengths_m.shape[1]:
        return None
    deviations = matched.bone_lengths_m.std(axis=0) * 1e3
    return float(np.where(deviations < ARITHMETIC_MM, 0.0, deviations).mean())
