"""A depth image reduced to a grid of points with normals, and the projection of points into the image."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from studio.engine.base.compiled import compiled
from studio.engine.model.cameras.depth import DepthCamera

Array = NDArray[np.float64]
GRID_WIDTH = 320
"""Approximate number of cells in a row; a cell is 1 cm wide at 2.5 m. With half as many, arms that swing in front of
a single camera are lost: they are only two cells wide, and readings at their edges mix near and far.
"""
_FILLED = 2
_NORMAL_REACH = 4
"""Distance in cells to the neighbours from which a normal is computed."""


class GridLens(NamedTuple):
    """The relation between the grid's cells and the camera's rays.

    Attributes:
        stride: pixels from cell to cell.
        intrinsics: fx, fy, cx, cy [pixels] and eight Brown-Conrady coefficients, shape (12,).
        rays: x/z and y/z of every pixel, shape (height, width, 2).
        reach: squared tangent of the largest angle at which the distortion is invertible.
    """

    stride: int
    intrinsics: Array
    rays: NDArray[np.float32]
    reach: float


def lens_of(camera: DepthCamera) -> GridLens:
    """Return the lens of a camera."""
    coefficients = (*camera.distortion, *(0.0,) * (8 - len(camera.distortion)))
    rays = camera.rays
    return GridLens(
        max(1, round(camera.width / GRID_WIDTH)),
        np.array([camera.fx, camera.fy, camera.cx, camera.cy, *coefficients]),
        rays,
        1.2 * float((rays.astype(np.float64) ** 2).sum(axis=2).max()),
    )


@compiled
def grid_points(depth_mm, lens, rotation, translation, points, depth):
    """Fill the grid: `points` in the working frame [m], shape (rows, columns, 3), and `depth`, z in the camera
    frame [m], shape (rows, columns), 0 without a reading or for a mixture of near and far.

    A cell holds its first pixel with a reading, of at least 2 x 2, because structured light leaves holes.
    """
    rows, columns = depth.shape
    stride = lens.stride
    block = max(stride, _FILLED)
    height, width = depth_mm.shape
    for i in range(rows):
        for j in range(columns):
            depth[i, j] = 0.0
            for k in range(block * block):
                v, u = i * stride + k // block, j * stride + k % block
                if v < height and u < width and depth_mm[v, u] > 0:
                    z = depth_mm[v, u] * 0.001
                    depth[i, j] = z
                    x, y = lens.rays[v, u, 0] * z, lens.rays[v, u, 1] * z
                    for a in range(3):
                        points[i, j, a] = (
                            rotation[a, 0] * x + rotation[a, 1] * y + rotation[a, 2] * z + translation[a]
                        )
                    break


@compiled
def confirmed(depth, keep):
    """Fill `keep`, shape (rows, columns): whether a cell has two neighbours at about its depth."""
    rows, columns = depth.shape
    for i in range(rows):
        for j in range(columns):
            z = depth[i, j]
            keep[i, j] = False
            if z <= 0.0:
                continue
            near = 0.025 + 0.004 * z * z
            count = 0
            if i > 0 and abs(depth[i - 1, j] - z) < near:
                count += 1
            if j > 0 and abs(depth[i, j - 1] - z) < near:
                count += 1
            if i + 1 < rows and abs(depth[i + 1, j] - z) < near:
                count += 1
            if j + 1 < columns and abs(depth[i, j + 1] - z) < near:
                count += 1
            keep[i, j] = count >= 2


@compiled
def normal_at(points, depth, i, j, normal):
    """Write the unit normal of a cell's surface, towards the camera; zeros where unknown."""
    rows, columns = depth.shape
    normal[:] = 0.0
    reach = _NORMAL_REACH
    z = depth[i, j]
    near = 0.08 + 0.04 * z
    if i < reach or j < reach or i + reach >= rows or j + reach >= columns:
        return
    for v, u in ((i - reach, j), (i + reach, j), (i, j - reach), (i, j + reach)):
        if depth[v, u] <= 0.0 or abs(depth[v, u] - z) > near:
            return
    ax = points[i, j + reach, 0] - points[i, j - reach, 0]
    ay = points[i, j + reach, 1] - points[i, j - reach, 1]
    az = points[i, j + reach, 2] - points[i, j - reach, 2]
    bx = points[i + reach, j, 0] - points[i - reach, j, 0]
    by = points[i + reach, j, 1] - points[i - reach, j, 1]
    bz = points[i + reach, j, 2] - points[i - reach, j, 2]
    x, y, z = by * az - bz * ay, bz * ax - bx * az, bx * ay - by * ax
    length = np.sqrt(x * x + y * y + z * z)
    if length > 1e-9:
        normal[0], normal[1], normal[2] = x / length, y / length, z / length


@compiled
def sampled(points, depth, labels, chosen, count, eye):
    """Return about `count` points of the chosen clusters, evenly over the grid, unit vectors to the camera at `eye`,
    and normals, each of shape (point_count, 3)."""
    rows, columns = depth.shape
    total = 0
    for i in range(rows):
        for j in range(columns):
            if labels[i, j] >= 0 and chosen[labels[i, j]]:
                total += 1
    step = max(total / count, 1.0)
    size = int(total / step)
    places = np.zeros((size, 3))
    views = np.zeros((size, 3))
    normals = np.zeros((size, 3))
    seen, k = 0, 0
    for i in range(rows):
        for j in range(columns):
            if labels[i, j] < 0 or not chosen[labels[i, j]]:
                continue
            if k < size and seen >= int((k + 0.5) * step):
                x, y, z = eye[0] - points[i, j, 0], eye[1] - points[i, j, 1], eye[2] - points[i, j, 2]
                length = np.sqrt(x * x + y * y + z * z)
                views[k, 0], views[k, 1], views[k, 2] = x / length, y / length, z / length
                places[k] = points[i, j]
                normal_at(points, depth, i, j, normals[k])
                facing = (
                    normals[k, 0] * views[k, 0] + normals[k, 1] * views[k, 1] + normals[k, 2] * views[k, 2]
                )
                if facing < 0.0:
                    normals[k] = -normals[k]
                k += 1
            seen += 1
    return places[:k], views[:k], normals[:k]
