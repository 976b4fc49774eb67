"""Percentage of correct keypoints, as a share: joints within a distance of their true place.

Source: 3DPCK as in Mehta et al., "Monocular 3D human pose estimation in the wild using improved CNN supervision",
3DV 2017, section 5, whose threshold is 150 mm; after one rigid alignment of the whole take.
"""

import numpy as np

from studio.engine.metrics.reference.matching import Matched


def pck(matched: Matched, threshold_mm: float) -> float:
    """Return the share of measured joints within `threshold_mm`, 0..1: mean over joints of their shares of frames."""
    solve, reference = matched.pick(matched.joints)
    error_mm = np.linalg.norm(solve - reference, axis=2) * 1e3
    known = np.isfinite(error_mm)
    return float(((error_mm <= threshold_mm).sum(axis=0) / known.sum(axis=0)).mean())
