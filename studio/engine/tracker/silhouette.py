"""Free space: no part of the body may be where a camera looks past it or through it."""

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from studio.engine.tracker.chain import add_row
from studio.engine.tracker.grid import Lens, cell_of

Array = NDArray[np.float64]

FRONT_M = 0.04
"""A body may lie this far in front of what is seen before it counts [m]."""
FAR_M = 0.40
"""Beyond this a violation counts no more [m]."""


class Silhouette(NamedTuple):
    """The performer in one camera's image.

    Attributes:
        lens: of the camera.
        rotation, translation: of `T_camera_work`.
        depth: of each cell [m], 0 = no reading, shape (rows, columns).
        nearest: flat index of the nearest cell of the performer, -1 = none, shape (rows, columns).
    """

    lens: Lens
    rotation: Array
    translation: Array
    depth: Array
    nearest: NDArray[np.int32]


@njit(cache=True)
def nearest_cells(person, nearest):  # type: ignore[no-untyped-def]
    """Fill `nearest` by two sweeps that hand on the nearest cell known (Danielsson, "Euclidean distance mapping",
    1980)."""
    rows, columns = person.shape
    for i in range(rows):
        for j in range(columns):
            nearest[i, j] = i * columns + j if person[i, j] else -1
    for sweep in range(2):
        for a in range(rows):
            i = a if sweep == 0 else rows - 1 - a
            near = -1 if sweep == 0 else 1
            for turn in range(2):
                for b in range(columns):
                    j = b if turn == 0 else columns - 1 - b
                    best = nearest[i, j]
                    if best == i * columns + j:
                        continue
                    least = 1 << 30
                    if best >= 0:
                        least = (best // columns - i) ** 2 + (best % columns - j) ** 2
                    for k in range(4):
                        v, u = i + near, j - 1 + k
                        if k == 3:
                            v, u = i, (j - 1 if turn == 0 else j + 1)
                        if v < 0 or u < 0 or v >= rows or u >= columns:
                            continue
                        other = nearest[v, u]
                        if other >= 0:
                            d = (other // columns - i) ** 2 + (other % columns - j) ** 2
                            if d < least:
                                least, best = d, other
                    nearest[i, j] = best


@njit(cache=True)
def violation(seen, point, radius, normal):  # type: ignore[no-untyped-def]
    """Return how far a ball of the body is in free space for one camera [m], 0 where it may be, and write the
    direction in which it should move into `normal`, shape (3,), in the working frame."""
    r, t = seen.rotation, seen.translation
    x = r[0, 0] * point[0] + r[0, 1] * point[1] + r[0, 2] * point[2] + t[0]
    y = r[1, 0] * point[0] + r[1, 1] * point[1] + r[1, 2] * point[2] + t[1]
    z = r[2, 0] * point[0] + r[2, 1] * point[1] + r[2, 2] * point[2] + t[2]
    row, column = cell_of(seen.lens, x, y, z)
    rows, columns = seen.depth.shape
    i, j = int(np.floor(row + 0.5)), int(np.floor(column + 0.5))
    if row < 0 or i < 0 or j < 0 or i >= rows or j >= columns:
        return 0.0
    best = seen.nearest[i, j]
    if best < 0:
        return 0.0
    v, u = best // columns, best % columns
    cell = z * seen.lens.stride / seen.lens.intrinsics[0]
    aside = np.sqrt((v - row) ** 2 + (u - column) ** 2) * cell
    depth = seen.depth[i, j]
    if (v != i or u != j) and aside > 1.5 * cell:
        if 0.0 < depth < z - radius - 0.10:
            return 0.0  # something stands before it
        dx, dy = (u - column) * cell / aside, (v - row) * cell / aside
        for a in range(3):
            normal[a] = r[0, a] * dx + r[1, a] * dy
        return min(aside - 1.5 * cell, FAR_M)
    front = seen.depth[v, u] - (z - radius)
    if front > FRONT_M:
        size = np.sqrt(x * x + y * y + z * z)
        for a in range(3):
            normal[a] = (r[0, a] * x + r[1, a] * y + r[2, a] * z) / size
        return min(front - FRONT_M, FAR_M)
    return 0.0


@njit(cache=True)
def free_rows(seen, chain, surface, places, axes, origins, frames, samples, rows, offsets, begin):  # type: ignore[no-untyped-def]
    """Write a row for every sample in free space from row `begin` on, and return the row after the last.

    Args:
        samples: cone and share of its length, shape (sample_count, 2).
    """
    normal = np.zeros(3)
    point = np.zeros(3)
    row = begin
    for k in range(len(samples)):
        c, t = int(samples[k, 0]), samples[k, 1]
        for i in range(3):
            point[i] = origins[c, i] + frames[c, i, 2] * t * surface.length[c]
        radius = surface.start_radius[c] + t * (surface.end_radius[c] - surface.start_radius[c])
        away = violation(seen, point, radius / max(surface.flat[c], 1.0), normal)
        if away > 0.0:
            add_row(chain, places, axes, surface.body[c], point, normal, rows[row])
            offsets[row] = away
            row += 1
    return row
