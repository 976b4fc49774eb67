"""Frames in which a camera swapped left and right, found by comparing the cameras with each other."""

from itertools import combinations, product

import numpy as np
from numpy.typing import NDArray

from studio.engine.model.joints import MIRROR

_LATERAL = np.flatnonzero(MIRROR != np.arange(len(MIRROR)))
_CAP_M = 0.3
"""Largest distance that a single joint contributes."""
_MARGIN_M = 0.02
"""Smallest mean gain of a swap's correction, so that legs held together do not flicker."""


def _costs(a: NDArray[np.float64], b: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the mean clipped distance [m] of lateral joints per instant, 0 where no joint is seen by both."""
    distance = np.minimum(np.linalg.norm(a[:, _LATERAL] - b[:, _LATERAL], axis=2), _CAP_M)
    seen = np.isfinite(distance)
    return np.where(seen, distance, 0.0).sum(axis=1) / np.maximum(seen.sum(axis=1), 1)


def find_swaps(positions: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Return where each camera's left and right are to be exchanged, so that all agree with the first camera.

    The assignment with the lowest cost is taken at every instant.

    Args:
        positions: all cameras' joints in one frame [m], shape (camera_count, instant_count, 21, 3); NaN = unseen.

    Returns:
        Shape (camera_count, instant_count). The first camera is never exchanged, because the joints show only which
        cameras agree, not which one is right.
    """
    cameras, instants = positions.shape[:2]
    swapped = positions[:, :, MIRROR]
    choices = np.array([(False, *rest) for rest in product((False, True), repeat=cameras - 1)])
    total = choices.sum(axis=1)[:, None] * np.full(instants, _MARGIN_M)
    for i, j in combinations(range(cameras), 2):
        same = _costs(positions[i], positions[j])
        crossed = _costs(positions[i], swapped[j])
        total += np.where((choices[:, i] == choices[:, j])[:, None], same, crossed)
    return choices[np.argmin(total, axis=0)].T


def exchange(positions: NDArray[np.float64], swapped: NDArray[np.bool_]) -> NDArray[np.float64]:
    """Return an array per joint, shape (instant_count, 21, ...), with left and right exchanged where `swapped`."""
    out = positions.copy()
    out[swapped] = positions[swapped][:, MIRROR]
    return out
