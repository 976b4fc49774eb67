"""Lag of a solve behind a reference on the same clock."""

import numpy as np
from numpy.typing import NDArray

from studio.engine.metrics.reference.matching import Matched
from studio.engine.metrics.reference.reference import Reference
from studio.engine.model.joints import INDEX

LONGEST_S = 0.25
"""Largest lag in the search, in both directions."""


def latency_ms(matched: Matched, reference: Reference) -> float | None:
    """Return the lag [ms] at which the joint velocities correlate best; positive = the solve is late.

    Velocities are central differences at the solve's rate over all measured joints and axes. The correlation is
    normalised, so that a smoothed solve is not biased to faster motion. It is first computed in whole frames, then
    refined to fractions of a frame on the reference's splines. None if the take is motionless or under 1 s.
    The match must be on one clock, already aligned rigidly (`alignment.align`).
    """
    step = 1.0 / matched.rate_hz
    window = (matched.time_s >= reference.time_s[0] + LONGEST_S + step) & (
        matched.time_s <= reference.time_s[-1] - LONGEST_S - step
    )
    if window.sum() < max(4, 1.0 / step):
        return None
    time = matched.time_s
    joints = [INDEX[name] for name in matched.joints]
    solve = _velocity(matched.solve_m[:, joints], time)

    def correlation(lag_s: float) -> float:
        velocity = _velocity(reference.at(time - lag_s)[:, joints], time)
        valid = np.isfinite(solve) & np.isfinite(velocity) & window[1:-1, None, None]
        a, b = solve[valid], velocity[valid]
        power = float(np.sqrt((a @ a) * (b @ b)))
        return float(a @ b) / power if power > 0 else 0.0

    from scipy.optimize import minimize_scalar  # slow to load: not at the start of the server

    frames = int(LONGEST_S / step)
    lags = step * np.arange(-frames, frames + 1)
    scores = np.array([correlation(lag) for lag in lags])
    if scores.max() < 0.1:
        return None
    best = float(lags[int(np.argmax(scores))])
    found = minimize_scalar(
        lambda lag: -correlation(lag),
        bounds=(best - step, best + step),
        method="bounded",
        options={"xatol": 1e-6},
    )
    return float(found.x) * 1e3


def _velocity(positions_m: NDArray[np.float64], time_s: NDArray[np.float64]) -> NDArray[np.float64]:
    """Central differences [m/s], shape (frame_count - 2, ...)."""
    return (positions_m[2:] - positions_m[:-2]) / (time_s[2:] - time_s[:-2])[:, None, None]
