"""How smooth a solve is, by finite differences at the solve's own rate.

The differences are taken at the solve's rate for the solve and for the reference (resampled to the same
instants), so that both lose the same high frequencies. Around a gap in the solve's frames nothing is counted.
Source: mean jerk as in Flash and Hogan, "The coordination of arm movements", J. Neurosci. 1985; the
acceleration error as in Kanazawa et al., "Learning 3D human dynamics from video", CVPR 2019, section 4.
"""

import numpy as np
from numpy.typing import NDArray

from studio.engine.metrics.matching import Matched


def acceleration_error_m_s2(matched: Matched) -> float | None:
    """Mean over measured joints and frames of the norm of the difference of second differences [m/s2]."""
    solve, reference = matched.pick(matched.joints)
    return _mean_norm(_difference(solve - reference, matched, 2))


def jerk_m_s3(matched: Matched) -> float | None:
    """Mean norm of the solve's third differences over measured joints and frames [m/s3]."""
    return _mean_norm(_difference(matched.pick(matched.joints)[0], matched, 3))


def reference_jerk_m_s3(matched: Matched) -> float | None:
    """The same of the reference [m/s3]."""
    return _mean_norm(_difference(matched.pick(matched.joints)[1], matched, 3))


def _difference(positions_m: NDArray[np.float64], matched: Matched, order: int) -> NDArray[np.float64]:
    """Finite difference of an order, divided by the step to that power; NaN where the steps are not even."""
    step = 1.0 / matched.rate_hz
    even = np.abs(np.diff(matched.time_s) - step) < 0.1 * step
    out = np.diff(positions_m, n=order, axis=0) / step**order
    whole = np.lib.stride_tricks.sliding_window_view(even, order).all(axis=1)
    out[~whole] = np.nan
    return out


def _mean_norm(vectors: NDArray[np.float64]) -> float | None:
    norms = np.linalg.norm(vectors, axis=2)
    norms = norms[np.isfinite(norms)]
    return float(norms.mean()) if len(norms) else None
