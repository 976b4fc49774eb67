"""Free space: space that a camera sees through, so no part of the body can be there."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from studio.engine.base.compiled import compiled
from studio.engine.seeing.images.grid import GridLens

Array = NDArray[np.float64]

FRONT_M = 0.04
"""Allowed distance of a body in front of the seen surface [m]."""
SOLID_M = 0.12
"""Minimum distance that a camera must see beyond a part of the body for the space to be free [m]."""
FAR_M = 0.40
"""Violations are clipped at this [m]."""


class Silhouette(NamedTuple):
    """The performer in one camera's image.

    Attributes:
        lens: of the camera.
        rotation, translation: of `T_camera_work`.
        depth: of each cell [m], 0 = no reading, shape (rows, columns).
        nearest: flat index of the nearest cell of the performer, -1 = none, shape (rows, columns).
        unread: whether cells without a reading are undecided for samples of the body, by cone and `unread_column`,
            shape (cone_count, 3); for other samples, such cells are free space.
        nearest_unread: as `nearest`, for cells of the performer or without readings; used for undecided samples.
    """

    lens: GridLens
    rotation: Array
    translation: Array
    depth: Array
    nearest: NDArray[np.int32]
    unread: NDArray[np.bool_]
    nearest_unread: NDArray[np.int32]


@compiled
def nearest_cells(person, margin, nearest):
    """Fill `nearest` by two sweeps that propagate the nearest known cell (Danielsson, "Euclidean distance mapping",
    1980), up to `margin` cells around the person; cells further away have the value at that edge.
    """
    rows, columns = person.shape
    row_of = np.full(person.shape, -1, np.int32)
    column_of = np.empty(person.shape, np.int32)
    top, bottom, left, right = rows, -1, columns, -1
    for i in range(rows):
        for j in range(columns):
            if person[i, j]:
                row_of[i, j], column_of[i, j] = i, j
                top, bottom = min(top, i), max(bottom, i)
                left, right = min(left, j), max(right, j)
    nearest[:] = -1
    if bottom < 0:
        return
    top, bottom = max(top - margin, 0), min(bottom + margin, rows - 1)
    left, right = max(left - margin, 0), min(right + margin, columns - 1)
    for sweep in range(2):
        near = -1 if sweep == 0 else 1
        for a in range(bottom - top + 1):
            i = top + a if sweep == 0 else bottom - a
            for turn in range(2):
                for b in range(right - left + 1):
                    j = left + b if turn == 0 else right - b
                    r, c = row_of[i, j], column_of[i, j]
                    least = (r - i) ** 2 + (c - j) ** 2 if r >= 0 else 1 << 30
                    if least == 0:
                        continue
                    for k in range(4):
                        v, u = i + near, j - 1 + k
                        if k == 3:
                            v, u = i, (j - 1 if turn == 0 else j + 1)
                        if v < top or u < left or v > bottom or u > right or row_of[v, u] < 0:
                            continue
                        d = (row_of[v, u] - i) ** 2 + (column_of[v, u] - j) ** 2
                        if d < least:
                            least, r, c = d, row_of[v, u], column_of[v, u]
                    row_of[i, j], column_of[i, j] = r, c
    for i in range(rows):
        v = min(max(i, top), bottom)
        for j in range(columns):
            u = min(max(j, left), right)
            nearest[i, j] = row_of[v, u] * columns + column_of[v, u]


@compiled
def unread_cells(depth, nearest):
    """Return which cells may show the performer's legs, shape (rows, columns): the performer's own, and cells without
    a reading among others without one.
    """
    rows, columns = depth.shape
    out = np.empty(depth.shape, np.bool_)
    for i in range(rows):
        for j in range(columns):
            out[i, j] = nearest[i, j] == i * columns + j
            if depth[i, j] > 0.0:
                continue
            count = 0
            for a in range(max(i - 1, 0), min(i + 2, rows)):
                for b in range(max(j - 1, 0), min(j + 2, columns)):
                    count += depth[a, b] <= 0.0
            out[i, j] |= count >= 5
    return out


@compiled
def _cell_of(lens, x, y, z):
    """Return row and column (real numbers) of the projection of a camera-frame point, -1 outside."""
    if z < 0.1:
        return -1.0, -1.0
    k = lens.intrinsics
    a, b = x / z, y / z
    r2 = a * a + b * b
    if r2 > lens.reach:
        return -1.0, -1.0
    factor = (1 + r2 * (k[4] + r2 * (k[5] + r2 * k[8]))) / (1 + r2 * (k[9] + r2 * (k[10] + r2 * k[11])))
    u = a * factor + 2 * k[6] * a * b + k[7] * (r2 + 2 * a * a)
    v = b * factor + k[6] * (r2 + 2 * b * b) + 2 * k[7] * a * b
    return (v * k[1] + k[3]) / lens.stride, (u * k[0] + k[2]) / lens.stride


@compiled
def unread_column(share):
    """Return the column of `Silhouette.unread` of a sample at a share of its cone's length."""
    return min(int(3.0 * share), 2)


@compiled
def _violation(seen, point, radius, unread, normal):
    """Return how far a ball of the body lies in one camera's free space [m], 0 = not at all, and write the direction
    in which it should move into `normal`, shape (3,), in the working frame.

    Args:
        unread: whether cells without a reading are undecided for the ball.
    """
    r, t = seen.rotation, seen.translation
    x = r[0, 0] * point[0] + r[0, 1] * point[1] + r[0, 2] * point[2] + t[0]
    y = r[1, 0] * point[0] + r[1, 1] * point[1] + r[1, 2] * point[2] + t[1]
    z = r[2, 0] * point[0] + r[2, 1] * point[1] + r[2, 2] * point[2] + t[2]
    row, column = _cell_of(seen.lens, x, y, z)
    rows, columns = seen.depth.shape
    i, j = int(np.floor(row + 0.5)), int(np.floor(column + 0.5))
    if row < 0 or i < 0 or j < 0 or i >= rows or j >= columns:
        return 0.0
    best = seen.nearest_unread[i, j] if unread else seen.nearest[i, j]
    if best < 0:
        return 0.0
    v, u = best // columns, best % columns
    cell = z * seen.lens.stride / seen.lens.intrinsics[0]
    aside = np.sqrt((v - row) ** 2 + (u - column) ** 2) * cell
    depth = seen.depth[i, j]
    if depth <= 0.0 and unread:
        return 0.0
    if (v != i or u != j) and aside > 1.5 * cell:
        if 0.0 < depth < z + SOLID_M:
            return 0.0  # a surface there or nearer: the floor under a foot, a leg thinner than a cell
        dx, dy = (u - column) * cell / aside, (v - row) * cell / aside
        for a in range(3):
            normal[a] = r[0, a] * dx + r[1, a] * dy
        return min(aside - 1.5 * cell, FAR_M)
    front = seen.depth[v, u] - (z - radius)
    if front > FRONT_M:  # less than 0 without a reading
        size = np.sqrt(x * x + y * y + z * z)
        for a in range(3):
            normal[a] = (r[0, a] * x + r[1, a] * y + r[2, a] * z) / size
        return min(front - FRONT_M, FAR_M)
    return 0.0


@compiled
def free_space(seen, surface, origins, frames, samples):
    """Return the samples in a camera's free space: bodies, points, directions in which they should move,
    violations [m], and indices of the samples.
    """
    bodies = np.empty(len(samples), np.int64)
    which = np.empty(len(samples), np.int64)
    points = np.empty((len(samples), 3))
    normals = np.empty((len(samples), 3))
    offsets = np.empty(len(samples))
    count = 0
    for k in range(len(samples)):
        c, t = int(samples[k, 0]), samples[k, 1]
        for i in range(3):
            points[count, i] = origins[c, i] + frames[c, i, 2] * t * surface.length[c]
        radius = surface.start_radius[c] + t * (surface.end_radius[c] - surface.start_radius[c])
        unread = seen.unread[surface.number[c], unread_column(t)]
        away = _violation(seen, points[count], radius / max(surface.flat[c], 1.0), unread, normals[count])
        if away > 0.0:
            bodies[count] = surface.body[c]
            offsets[count] = away
            which[count] = k
            count += 1
    return bodies[:count], points[:count], normals[:count], offsets[:count], which[:count]


@compiled
def free_cost(seen, surface, origins, frames, cones, samples):
    """Return the sum of squared violations of free space by the limb's samples, per candidate."""
    costs = np.zeros(len(origins))
    normal = np.zeros(3)
    point = np.zeros(3)
    for k in range(len(origins)):
        for m in range(len(samples)):
            c, t = int(samples[m, 0]), samples[m, 1]
            n = 0
            while cones[n] != c:
                n += 1
            for i in range(3):
                point[i] = origins[k, n, i] + frames[k, n, i, 2] * t * surface.length[c]
            radius = surface.start_radius[c] + t * (surface.end_radius[c] - surface.start_radius[c])
            unread = seen.unread[surface.number[c], unread_column(t)]
            away = _violation(seen, point, radius / max(surface.flat[c], 1.0), unread, normal)
            costs[k] += away * away
    return costs


SEEN, UNREAD, COVERED, OUTSIDE = 0, 1, 2, 3
"""What a camera shows at a part of the body: the part or something behind it; no reading; something else in front of
it; nothing, because the part is outside the picture."""
_COVERED_M = 0.25


@compiled
def _cell_at(seen, point):
    """Return row and column of the cell that shows a point of the working frame, -1 outside, and its depth [m]."""
    r, t = seen.rotation, seen.translation
    rows, columns = seen.depth.shape
    x, y, z = point
    u, v, w = (
        r[0, 0] * x + r[0, 1] * y + r[0, 2] * z + t[0],
        r[1, 0] * x + r[1, 1] * y + r[1, 2] * z + t[1],
        r[2, 0] * x + r[2, 1] * y + r[2, 2] * z + t[2],
    )
    row, column = _cell_of(seen.lens, u, v, w)
    i, j = int(np.floor(row + 0.5)), int(np.floor(column + 0.5))
    if row < 0 or i < 0 or j < 0 or i >= rows or j >= columns:
        return -1, -1, w
    return i, j, w


@compiled
def shown(seen, points):
    """Return what a camera shows at points of the body's axes: `SEEN`, `UNREAD`, `COVERED` or `OUTSIDE`.

    Args:
        points: in the working frame [m], shape (point_count, 3).
    """
    rows, columns = seen.depth.shape
    out = np.empty(len(points), np.int64)
    for p in range(len(points)):
        i, j, w = _cell_at(seen, points[p])
        if i < 0:
            out[p] = OUTSIDE
            continue
        unread, covered, count = 0, 0, 0
        for a in range(max(i - 1, 0), min(i + 2, rows)):
            for b in range(max(j - 1, 0), min(j + 2, columns)):
                count += 1
                if seen.depth[a, b] <= 0.0:
                    unread += 1
                elif seen.depth[a, b] < w - _COVERED_M and seen.nearest[a, b] != a * columns + b:
                    covered += 1
        if 2 * covered > count:
            out[p] = COVERED
        elif seen.depth[i, j] <= 0.0 and 3 * unread >= count:
            out[p] = UNREAD
        else:
            out[p] = SEEN
    return out


_UNREAD_M, _OUT_OF_VIEW_M = 0.5, 1.0
_USUAL_M = 0.07
"""Usual depth of a joint's centre behind the skin."""


@compiled
def _behind(seen, points, behind):
    rows, columns = seen.depth.shape
    around = np.empty(9)
    for p in range(len(points)):
        i, j, w = _cell_at(seen, points[p])
        if i < 0:
            behind[p] = _OUT_OF_VIEW_M
            continue
        count = 0
        for a in range(max(i - 1, 0), min(i + 2, rows)):
            for b in range(max(j - 1, 0), min(j + 2, columns)):
                if seen.depth[a, b] > 0.0:
                    around[count] = seen.depth[a, b]
                    count += 1
        behind[p] = w - np.median(around[:count]) if count > 0 else _UNREAD_M


def behind_seen(silhouettes: tuple[Silhouette, ...], points: Array) -> Array:
    """Return the depth of points behind the seen surface [m], shape (point_count,), negative = in front of it. Of all
    cameras' depths, the one nearest to a joint's usual depth counts.
    """
    best = np.full(len(points), _OUT_OF_VIEW_M)
    behind = np.empty(len(points))
    for seen in silhouettes:
        _behind(seen, points, behind)
        best = np.where(np.abs(behind - _USUAL_M) < np.abs(best - _USUAL_M), behind, best)
    return best
