"""Cells of an image and the bodies on the stage: distance of each cell from each body, and the cell's owner."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from studio.engine.base.compiled import compiled
from studio.engine.seeing.fitting.chain import Pose
from studio.engine.seeing.fitting.fit import BodyShape, Fitter

Array = NDArray[np.float64]

FAR_M = 0.5
"""Distances from bodies are clipped at this [m]."""
SEED_M, MARGIN_M = 0.07, 0.04
"""A cell seeds a body's region if it is nearer to it than the first, and farther from others by the second [m]."""


class PlacedBodies(NamedTuple):
    """The rounded cones of several bodies in the working frame, one after the other.

    Attributes:
        origins, frames: of each cone, shapes (cone_count, 3) and (cone_count, 3, 3).
        sizes: length, radius at the start, radius at the end, flatness, shape (cone_count, 4); see `Surface`.
        body: index of each cone's body, shape (cone_count,).
        count: of bodies.
    """

    origins: Array
    frames: Array
    sizes: Array
    body: NDArray[np.int64]
    count: int  # pyright: ignore[reportIncompatibleMethodOverride]  # hides tuple.count

    @classmethod
    def of(cls, fitter: Fitter, bodies: Sequence[tuple[BodyShape, Pose]]) -> "PlacedBodies":
        """Place bodies of one chain."""
        placed = [fitter.place(figure, pose)[3:] for figure, pose in bodies]
        sizes = [
            np.stack([s.length, s.start_radius, s.end_radius, s.flat], axis=1)
            for s in (figure.surface for figure, _ in bodies)
        ]
        body = np.repeat(np.arange(len(bodies)), [len(one) for one in sizes])
        origins, frames = (np.concatenate(arrays) for arrays in zip(*placed, strict=True))
        return cls(origins, frames, np.concatenate(sizes), body, len(bodies))


@compiled
def cells_of(labels, wanted):
    """Return rows and columns of the cells of the wanted clusters, shape (cell_count, 2)."""
    rows, columns = labels.shape
    cells = np.empty((rows * columns, 2), np.int64)
    count = 0
    for i in range(rows):
        for j in range(columns):
            if labels[i, j] >= 0 and wanted[labels[i, j]]:
                cells[count, 0], cells[count, 1] = i, j
                count += 1
    return cells[:count].copy()


@compiled
def distances_of(points, cells, placed):
    """Return the distance of each cell's point from each body's surface [m], negative inside, shape (cell_count,
    body_count).
    """
    cones = len(placed.body)
    middle = np.empty((cones, 3))
    reach = np.empty(cones)
    for c in range(cones):
        length, start, end, _ = placed.sizes[c]
        reach[c] = 0.5 * length + max(start, end)
        for a in range(3):
            middle[c, a] = placed.origins[c, a] + 0.5 * length * placed.frames[c, a, 2]
    out = np.full((len(cells), placed.count), FAR_M)
    for n in range(len(cells)):
        px, py, pz = points[cells[n, 0], cells[n, 1]]
        for c in range(cones):
            b = placed.body[c]
            bound = out[n, b] + reach[c]
            dx, dy, dz = px - middle[c, 0], py - middle[c, 1], pz - middle[c, 2]
            if bound <= 0.0 or dx * dx + dy * dy + dz * dz > bound * bound:
                continue
            f = placed.frames[c]
            length, start, end, flat = placed.sizes[c]
            x = f[0, 0] * dx + f[1, 0] * dy + f[2, 0] * dz
            y = (f[0, 1] * dx + f[1, 1] * dy + f[2, 1] * dz) * flat
            z = f[0, 2] * dx + f[1, 2] * dy + f[2, 2] * dz + 0.5 * length
            t = min(max(z / length, 0.0), 1.0)
            beyond = z - t * length
            away = np.sqrt(x * x + y * y + beyond * beyond) - (start + t * (end - start))
            out[n, b] = min(out[n, b], away)
    return out


@compiled
def shared_out(depth, labels, cells, distance, seed_m, margin_m):
    """Return the body that owns each cell, shape (cell_count,): a seed's own body; for other cells the body of the
    nearest seed along the surface, else the body nearest to the cluster's remaining cells.

    Args:
        cells: rows and columns, shape (cell_count, 2).
        distance: of each from each body [m], shape (cell_count, body_count).
        seed_m, margin_m: see `SEED_M`.
    """
    rows, columns = labels.shape
    count, bodies = distance.shape
    index = np.full((rows, columns), -1, np.int64)
    owner = np.full(count, -1, np.int64)
    queue = np.empty(count, np.int64)
    queued = 0
    for n in range(count):
        index[cells[n, 0], cells[n, 1]] = n
        best = int(distance[n].argmin())
        others = FAR_M + margin_m
        for b in range(bodies):
            if b != best:
                others = min(others, distance[n, b])
        if distance[n, best] < seed_m and distance[n, best] + margin_m < others:
            owner[n] = best
            queue[queued] = n
            queued += 1
    done = 0
    while done < queued:
        n = queue[done]
        done += 1
        i, j = cells[n, 0], cells[n, 1]
        z = depth[i, j]
        for k in range(8):
            step = 1 if k < 4 else 2
            v = i + (step if k % 4 == 0 else -step if k % 4 == 1 else 0)
            u = j + (step if k % 4 == 2 else -step if k % 4 == 3 else 0)
            if v < 0 or u < 0 or v >= rows or u >= columns or index[v, u] < 0:
                continue
            m = index[v, u]
            near = 0.05 + 0.004 * z * z + (0.02 if step > 1 else 0.0)
            if owner[m] < 0 and labels[v, u] == labels[i, j] and abs(depth[v, u] - z) < near:
                owner[m] = owner[n]
                queue[queued] = m
                queued += 1
    sums = np.zeros((labels.max() + 2, bodies))
    for n in range(count):
        if owner[n] < 0:
            sums[labels[cells[n, 0], cells[n, 1]]] += distance[n]
    for n in range(count):
        if owner[n] < 0:
            owner[n] = int(sums[labels[cells[n, 0], cells[n, 1]]].argmin())
    return owner
