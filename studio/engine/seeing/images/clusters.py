"""Connected clusters of a grid of points: the people and objects on the floor."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from studio.engine.base.compiled import compiled

Array = NDArray[np.float64]


class Clusters(NamedTuple):
    """Connected clusters, the largest first.

    Attributes:
        labels: of each cell, -1 = none, shape (rows, columns).
        count: cells, shape (cluster_count,).
        area: area of the seen surface as if facing the camera [m2], shape (cluster_count,).
        low, high, middle: bounds and mean of the points [m], shape (cluster_count, 3).
    """

    labels: NDArray[np.int32]
    count: NDArray[np.int64]  # pyright: ignore[reportIncompatibleMethodOverride]  # hides tuple.count
    area: Array
    low: Array
    high: Array
    middle: Array


@compiled
def _root(parent, i):
    while parent[i] != i:
        parent[i] = parent[parent[i]]
        i = parent[i]
    return i


@compiled
def clusters_of(points, depth, use, cell_angle, least, most):
    """Return the clusters of the cells of `use` as a tuple of the fields of `Clusters`.

    Neighbours, also those one cell further (over a hole), are connected if they are less than 5 cm apart, plus
    the noise of depth and the slope of a surface.

    Args:
        cell_angle: tangent of the angle between neighbouring cells.
        least: smaller clusters [cells] are left out. most: largest number of clusters.
    """
    rows, columns = depth.shape
    parent = np.arange(rows * columns)
    for i in range(rows):
        for j in range(columns):
            if not use[i, j]:
                continue
            z = depth[i, j]
            for k in range(4):
                v, u = i, j
                if k == 0:
                    u = j - 1
                elif k == 1:
                    v = i - 1
                elif k == 2:
                    u = j - 2
                else:
                    v = i - 2
                if v < 0 or u < 0 or not use[v, u]:
                    continue
                if abs(depth[v, u] - z) < 0.05 + 0.004 * z * z + (0.02 if k > 1 else 0.0):
                    a, b = _root(parent, i * columns + j), _root(parent, v * columns + u)
                    if a < b:
                        parent[b] = a
                    else:
                        parent[a] = b
    size = np.zeros(rows * columns, np.int32)
    for i in range(rows):
        for j in range(columns):
            if use[i, j]:
                size[_root(parent, i * columns + j)] += 1
    large = np.flatnonzero(size >= least)
    order = large[np.argsort(-size[large], kind="mergesort")[:most]]
    kept = 0
    index = np.full(rows * columns, -1, np.int32)
    for k in range(len(order)):
        if size[order[k]] < least:
            break
        index[order[k]] = k
        kept = k + 1
    labels = np.full((rows, columns), -1, np.int32)
    count = np.zeros(kept, np.int64)
    area = np.zeros(kept)
    low = np.full((kept, 3), 1e9)
    high = np.full((kept, 3), -1e9)
    middle = np.zeros((kept, 3))
    for i in range(rows):
        for j in range(columns):
            if not use[i, j]:
                continue
            k = index[_root(parent, i * columns + j)]
            labels[i, j] = k
            if k < 0:
                continue
            count[k] += 1
            area[k] += (depth[i, j] * cell_angle) ** 2
            for a in range(3):
                x = points[i, j, a]
                low[k, a] = min(low[k, a], x)
                high[k, a] = max(high[k, a], x)
                middle[k, a] += x
    for k in range(kept):
        middle[k] /= count[k]
    return labels, count, area, low, high, middle
