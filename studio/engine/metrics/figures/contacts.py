"""Contacts with the floor in the solve, against those of the reference, and heights of standing feet.

The same rule (`feet.stance_of`) finds the contacts of both, so the figures show whether an animation's feet stand
when the performer's do. Source: contact detection by thresholds as in Rempe et al., "HuMoR", ICCV 2021.
"""

import numpy as np

from studio.engine.metrics.figures.feet import FOOT_JOINTS, stance_of
from studio.engine.metrics.reference.matching import Matched


def contact_precision_recall(matched: Matched) -> tuple[float | None, float | None]:
    """Return precision and recall over ankles, toes and frames, 0..1.

    None where the solve (precision) or the reference (recall) has no contact, or no feet.
    """
    names = [name for name in FOOT_JOINTS if matched.has(name)]
    if not names or len(matched.time_s) < 3:
        return None, None
    solve, reference = matched.pick(names)
    known = np.isfinite(reference).all(axis=2)
    found, true = (stance_of(x, matched.time_s) & known for x in (solve, reference))
    both = float((found & true).sum())
    return (
        both / float(found.sum()) if found.any() else None,
        both / float(true.sum()) if true.any() else None,
    )


def foot_heights_cm(matched: Matched) -> tuple[float | None, float | None]:
    """Return heights of standing ankles and toes above the reference's [cm]: mean, and mean absolute difference.

    The mean is positive for feet that float, negative for feet that sink. None where no foot stands.
    """
    names = [name for name in FOOT_JOINTS if matched.has(name)]
    if not names or len(matched.time_s) < 3:
        return None, None
    solve, reference = matched.pick(names)
    above = (solve - reference)[..., 2][stance_of(reference, matched.time_s)] * 100.0
    above = above[np.isfinite(above)]
    return (float(above.mean()), float(np.abs(above).mean())) if len(above) else (None, None)
