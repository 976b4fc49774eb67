"""Smoothness of a solve, by finite differences over 1/30 s.

The steps of the differences are 1/30 s at every rate of the solve, rounded to whole frames (every second frame at
60 Hz, every fourth at 120 Hz). They start at every frame, on the solve and on the reference at the solve's instants.
1/30 s is the frame period of the cameras. Shorter steps would measure the reference: markers have noise, which a
second difference multiplies by the square of the rate. Smoothing four marker references by a Gaussian of 17 ms
changes their own second differences over 1/60 s by 5 to 15 m/s2, over 1/30 s by 1.4 to 4.2. The fixed step also makes
solves of different rates comparable. Differences across a gap in the solve are left out.
Source: mean jerk as in Flash and Hogan, "The coordination of arm movements", J. Neurosci. 1985; the
acceleration error as in Kanazawa et al., "Learning 3D human dynamics from video", CVPR 2019, section 4.
"""

import numpy as np
from numpy.typing import NDArray

from studio.engine.metrics.reference.matching import Matched

STEP_HZ = 30.0
"""Rate of the differences' steps."""


def acceleration_error_m_s2(matched: Matched) -> float | None:
    """Mean over measured joints and frames of the norm of the difference of second differences [m/s2]."""
    solve, reference = matched.pick(matched.joints)
    return _mean_norm(_difference(solve - reference, matched, 2))


def jerk_m_s3(matched: Matched) -> float | None:
    """Mean norm of the solve's third differences over measured joints and frames [m/s3]."""
    return _mean_norm(_difference(matched.pick(matched.joints)[0], matched, 3))


def reference_jerk_m_s3(matched: Matched) -> float | None:
    """Mean norm of the reference's third differences [m/s3]."""
    return _mean_norm(_difference(matched.pick(matched.joints)[1], matched, 3))


def _difference(positions_m: NDArray[np.float64], matched: Matched, order: int) -> NDArray[np.float64]:
    """Finite difference of an order, divided by the step to that power; frames with a gap inside are left out."""
    frames = max(1, round(matched.rate_hz / STEP_HZ))
    if len(positions_m) <= frames * order:
        return positions_m[:0]
    frame_s = 1.0 / matched.rate_hz
    out = positions_m
    for _ in range(order):
        out = (out[frames:] - out[:-frames]) / (frames * frame_s)
    even = np.abs(np.diff(matched.time_s) - frame_s) < 0.1 * frame_s
    return out[np.lib.stride_tricks.sliding_window_view(even, frames * order).all(axis=1)]


def _mean_norm(vectors: NDArray[np.float64]) -> float | None:
    norms = np.linalg.norm(vectors, axis=2)
    norms = norms[np.isfinite(norms)]
    return float(norms.mean()) if len(norms) else None
