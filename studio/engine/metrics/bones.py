"""How constant a solve's bone lengths are; a human's are."""

import numpy as np

from studio.engine.joints import CANONICAL, INDEX, PARENT_OF_CANONICAL
from studio.engine.metrics.matching import Matched


def bone_length_sd_mm(matched: Matched) -> float:
    """Standard deviation of each canonical bone's length over time, as the mean over bones [mm].

    Bones with an end that the solve lacks are left out.
    """
    deviations = []
    for name in CANONICAL:
        if name not in PARENT_OF_CANONICAL:
            continue
        child, parent = INDEX[name], INDEX[PARENT_OF_CANONICAL[name]]
        length = np.linalg.norm(matched.solve_m[:, child] - matched.solve_m[:, parent], axis=1)
        if np.isfinite(length).all():
            deviations.append(float(length.std()))
    return float(np.mean(deviations)) * 1e3
