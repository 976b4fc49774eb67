"""Intervals of a mean by resampling (Efron and Tibshirani, "An Introduction to the Bootstrap", 1993, chapter 13)."""

import numpy as np
from numpy.typing import NDArray

DRAWS = 2000
_SEED = 20140
"""Fixed seed, so that equal figures give equal reports."""


def interval(values: NDArray[np.float64], *, share: float = 0.95) -> tuple[float, float]:
    """Return the percentile interval of the mean of independent values, shape (n,)."""
    rng = np.random.default_rng(_SEED)
    means = values[rng.integers(0, len(values), (DRAWS, len(values)))].mean(axis=1)
    tail = 50.0 * (1.0 - share)
    low, high = np.percentile(means, [tail, 100.0 - tail])
    return float(low), float(high)


def blocks(values: NDArray[np.float64], length: int) -> NDArray[np.float64]:
    """Return the means of blocks of frames, as errors of adjacent frames are correlated; the last includes the rest.

    Args:
        values: one per frame, shape (frame_count,); NaN = unknown.
        length: frames per block.
    """
    count = max(1, len(values) // length)
    ends = [*range(length, length * count, length), len(values)]
    parts = np.split(values, ends[:-1])
    means = [float(np.nanmean(part)) for part in parts if np.isfinite(part).any()]
    return np.array(means)
