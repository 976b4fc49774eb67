"""Separation of people who touch and so form one cluster. A person's legs, trunk and head are above each other,
unlike arms, so a person is a high column over the floor.
"""

import numpy as np
from numpy.typing import NDArray

from studio.engine.base.compiled import compiled
from studio.engine.seeing.bodies.cells import cells_of, shared_out
from studio.engine.seeing.images.clusters import Clusters

Array = NDArray[np.float64]

_CELL_M = 0.1
_AROUND = 2
"""Extent of a column to either side of its middle cell [cells of the floor]."""
_LEVELS = 24
_LEAST_LEVELS, _HIGH_SHARE = 8, 0.65
"""Minimum number of successive 10 cm levels with readings for a person, also as a share of the highest column's."""
_BESIDE_M = 0.45
"""Minimum distance between two people's columns [m]."""
_COLUMN_M = 0.25
_WIDE_M, _LARGE_M2 = 1.9, 0.55
"""Clusters wider or larger than this may be several people [m], [m2]."""
_MOST_M2, _HIGHEST_M = 1.8, 2.4
"""Larger or higher clusters are walls [m2], [m]."""


def apart(points: Array, depth: Array, clusters: Clusters, cell_angle: float) -> Clusters:
    """Return the clusters, with each cluster of several people split.

    Args:
        points: of the image's cells in the working frame [m], shape (rows, columns, 3).
        depth: of the cells [m], shape (rows, columns).
        cell_angle: tangent of the angle between neighbouring cells.
    """
    size = clusters.high - clusters.low
    large = (np.hypot(size[:, 0], size[:, 1]) > _WIDE_M) | (clusters.area > _LARGE_M2)
    large &= (clusters.area < _MOST_M2) & (clusters.high[:, 2] < _HIGHEST_M)
    labels, used = clusters.labels, len(clusters.count)
    for k in np.flatnonzero(large & (clusters.high[:, 2] > _CELL_M * _LEAST_LEVELS)):
        cells = cells_of(clusters.labels, np.arange(len(clusters.count)) == k)
        own = points[cells[:, 0], cells[:, 1]]
        middles = standing_in(own, depth[cells[:, 0], cells[:, 1]] * cell_angle)
        if len(middles) < 2:
            continue
        away = np.linalg.norm(own[:, None, :2] - middles, axis=2) - _COLUMN_M
        owner = shared_out(depth, clusters.labels, cells, away, 0.0, 0.0)
        labels = labels.copy() if labels is clusters.labels else labels
        labels[cells[:, 0], cells[:, 1]] = np.where(owner == 0, k, used - 1 + owner)
        used += len(middles) - 1
    return clusters if labels is clusters.labels else _measured(points, depth, labels, used, cell_angle)


def standing_in(points: Array, width_m: Array) -> Array:
    """Return where people stand, x and y [m], shape (person_count, 2), the best visible person first.

    Args:
        points: of one cluster [m], shape (point_count, 3). width_m: of their cells, shape (point_count,).
    """
    low = points[:, :2].min(axis=0) - _AROUND * _CELL_M
    high = points[:, :2].max(axis=0) + _AROUND * _CELL_M
    shape = np.ceil((high - low) / _CELL_M).astype(np.int64) + 1
    levels, area, middles = _columns(points, width_m, low, shape[0], shape[1])
    tall = levels >= max(_LEAST_LEVELS, _HIGH_SHARE * levels.max(initial=0))
    score = np.where(tall, area * levels, 0.0)
    found: list[Array] = []
    for at in np.argsort(-score, axis=None, kind="stable"):
        place = np.unravel_index(at, score.shape)
        if score[place] <= 0.0:
            break
        middle = middles[place]
        if all(np.hypot(*(middle - other)) > _BESIDE_M for other in found):
            found.append(middle)
    return np.array(found).reshape(-1, 2)


@compiled
def _columns(points, width, low, rows, columns):
    """Return, for the column around each cell of the floor: number of successive levels with readings (gaps of one
    level are allowed), area [m2], and middle [m].
    """
    here = np.zeros((rows, columns, _LEVELS), np.bool_)
    sums = np.zeros((rows, columns, 3))
    for p in range(len(points)):
        i = int((points[p, 0] - low[0]) / _CELL_M)
        j = int((points[p, 1] - low[1]) / _CELL_M)
        level = min(max(int(points[p, 2] / _CELL_M), 0), _LEVELS - 1)
        here[i, j, level] = True
        area = width[p] * width[p]
        sums[i, j, 0] += area
        sums[i, j, 1] += area * points[p, 0]
        sums[i, j, 2] += area * points[p, 1]
    levels = np.zeros((rows, columns), np.int64)
    areas = np.zeros((rows, columns))
    middles = np.zeros((rows, columns, 2))
    for i in range(rows):
        for j in range(columns):
            if sums[i, j, 0] <= 0.0:
                continue
            run, gap = 0, 0
            for level in range(_LEVELS):
                some = False
                for a in range(max(i - _AROUND, 0), min(i + _AROUND + 1, rows)):
                    for b in range(max(j - _AROUND, 0), min(j + _AROUND + 1, columns)):
                        some |= here[a, b, level]
                gap = 0 if some else gap + 1
                run = 0 if gap > 1 else run + some
                levels[i, j] = max(levels[i, j], run)
            for a in range(max(i - _AROUND, 0), min(i + _AROUND + 1, rows)):
                for b in range(max(j - _AROUND, 0), min(j + _AROUND + 1, columns)):
                    areas[i, j] += sums[a, b, 0]
                    middles[i, j, 0] += sums[a, b, 1]
                    middles[i, j, 1] += sums[a, b, 2]
            middles[i, j] /= areas[i, j]
    return levels, areas, middles


def _measured(points: Array, depth: Array, labels: NDArray[np.int32], count: int, angle: float) -> Clusters:
    """Return the clusters of these labels."""
    cells = labels >= 0
    of, own = labels[cells], points[cells]
    cell_count = np.bincount(of, minlength=count)
    area = np.bincount(of, weights=(depth[cells] * angle) ** 2, minlength=count).astype(np.float64)
    low, high = np.full((count, 3), 1e9), np.full((count, 3), -1e9)
    np.minimum.at(low, of, own)
    np.maximum.at(high, of, own)
    sums = np.stack([np.bincount(of, weights=own[:, a], minlength=count) for a in range(3)], axis=1)
    return Clusters(labels, cell_count, area, low, high, sums / np.maximum(cell_count, 1)[:, None])
