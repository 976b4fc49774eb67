"""Places of a standing joint: its path within a stance as a piecewise constant function with few changes.

A camera's joint wanders by centimetres over seconds, and so does its moving mean. A piecewise constant fit separates
noise from steps. It minimises the squared distance to the path, summed over time, plus `CHANGE_M2_S` for every
change, over all numbers and times of changes.

Source: the Potts functional, minimised exactly by dynamic programming: Friedrich, Kempe, Liebscher, Winkler,
"Complexity penalized M-estimation: fast computation", J. Computational and Graphical Statistics 17, 2008.
"""

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter1d

CHANGE_M2_S = 1e-3
"""Cost of a change of place, with the noise of depth cameras: a foot that is 6 cm away for half a second is at
another place.
"""

BLOCK_S = 0.1
"""Length of a block; places change between blocks."""

EASE_S = 0.08
"""Standard deviation of the Gaussian blend between two places."""


def places_of(
    path: NDArray[np.float64], dt: float, *, change_m2_s: float = CHANGE_M2_S
) -> NDArray[np.float64]:
    """Return the place of a joint in each frame of a stance [m], shape (frame_count, 3).

    Args:
        path: the joint's smooth path [m], shape (frame_count, 3).
        dt: time between frames [s].
        change_m2_s: cost of a change of place.
    """
    length = max(1, round(BLOCK_S / dt))
    starts = np.arange(0, len(path), length)
    sizes = np.diff(np.append(starts, len(path)))[:, None]
    squares = np.add.reduceat(path**2, starts).sum(axis=1)
    edges = _changes(np.add.reduceat(path, starts), squares, sizes[:, 0], change_m2_s / dt)
    places = np.empty_like(path)
    for first, last in pairwise(edges):
        rows = slice(starts[first], starts[last] if last < len(starts) else len(path))
        places[rows] = path[rows].mean(axis=0)
    return gaussian_filter1d(places, EASE_S / dt, axis=0, mode="nearest") if len(edges) > 2 else places


def _changes(
    sums: NDArray[np.float64], squares: NDArray[np.float64], sizes: NDArray[np.int64], change_m2: float
) -> list[int]:
    """First blocks of the places, and the number of blocks.

    Args:
        sums: of each block's path, shape (block_count, 3).
        squares: sums of its squares, shape (block_count,).
        sizes: frames in it, shape (block_count,).
        change_m2: cost of a change, in the unit of the frames' squares.
    """
    count = len(sizes)
    sum_to = np.concatenate([np.zeros((1, 3)), np.cumsum(sums, axis=0)])
    square_to = np.concatenate([[0.0], np.cumsum(squares)])
    size_to = np.concatenate([[0], np.cumsum(sizes)])
    least, begin = np.zeros(count + 1), np.zeros(count + 1, dtype=np.int64)
    for end in range(1, count + 1):
        total = sum_to[end] - sum_to[:end]
        spread = square_to[end] - square_to[:end] - (total**2).sum(axis=1) / (size_to[end] - size_to[:end])
        cost = least[:end] + spread + change_m2
        begin[end] = np.argmin(cost)
        least[end] = cost[begin[end]]
    edges = [count]
    while edges[-1] > 0:
        edges.append(int(begin[edges[-1]]))
    return edges[::-1]
