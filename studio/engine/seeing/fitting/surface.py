"""Matches of points with rounded cones, as seen from each point's camera."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from studio.engine.base.compiled import compiled
from studio.engine.seeing.fitting.cones import PARTS

Array = NDArray[np.float64]
PART_COUNT = len(PARTS)

FAR_M = 0.40
"""Points farther than this from the body have no match [m]."""
NORMAL_COST_M2 = 0.05**2
"""Penalty on the squared distance for a surface that faces the other way than the measured one [m2]."""


class Matches(NamedTuple):
    """Matches of measured points on the body.

    Attributes:
        cone: index of the matched cone, shape (point_count,).
        place: matched point of the surface [m], shape (point_count, 3). normal: outward there, same shape.
        offset: signed distance of the measured point outside, along the normal [m], shape (point_count,).
        distance: to each part's best match [m], including the penalty of a wrong normal, shape (point_count, 5).
    """

    cone: NDArray[np.int64]
    place: Array
    normal: Array
    offset: Array
    distance: Array


@compiled
def _match_cone(px, py, pz, vx, vy, vz, surface, origins, frames, c):
    """Return the point of cone `c` facing the camera that is nearest to (px, py, pz), the outward normal there, and
    the signed distance along the normal [m]: seven numbers.

    A point in front of the cone's axis is matched with the nearest place of the surface. A point behind it, seen from
    the camera, is matched along its ray with the side that faces the camera, because the camera cannot see the far
    side.

    Args:
        vx, vy, vz: unit vector from the point to its camera.
    """
    f = frames[c]
    dx, dy, dz = px - origins[c, 0], py - origins[c, 1], pz - origins[c, 2]
    flat = surface.flat[c]
    x = f[0, 0] * dx + f[1, 0] * dy + f[2, 0] * dz
    y = (f[0, 1] * dx + f[1, 1] * dy + f[2, 1] * dz) * flat
    z = f[0, 2] * dx + f[1, 2] * dy + f[2, 2] * dz
    wx = f[0, 0] * vx + f[1, 0] * vy + f[2, 0] * vz
    wy = (f[0, 1] * vx + f[1, 1] * vy + f[2, 1] * vz) * flat
    wz = f[0, 2] * vx + f[1, 2] * vy + f[2, 2] * vz
    size = 1.0 / np.sqrt(wx * wx + wy * wy + wz * wz)
    wx, wy, wz = wx * size, wy * size, wz * size
    long, taper = surface.length[c], surface.start_radius[c] - surface.end_radius[c]
    t = (z - np.sqrt(x * x + y * y) * taper / long) / long
    t = min(max(t, 0.0), 1.0)
    radius = surface.start_radius[c] - t * taper
    nx, ny, nz = x, y, z - t * long
    along = nx * wx + ny * wy + nz * wz
    if along < 0.0:
        nx, ny, nz = nx - along * wx, ny - along * wy, nz - along * wz
        square = nx * nx + ny * ny + nz * nz
        if square < radius * radius:
            front = np.sqrt(radius * radius - square)
            nx, ny, nz = nx + front * wx, ny + front * wy, nz + front * wz
    size = 1.0 / max(np.sqrt(nx * nx + ny * ny + nz * nz), 1e-9)
    nx, ny, nz = nx * size, ny * size, nz * size
    sx, sy, sz = radius * nx, radius * ny / flat, t * long + radius * nz
    ny = ny * flat
    size = 1.0 / np.sqrt(nx * nx + ny * ny + nz * nz)
    nx, ny, nz = nx * size, ny * size, nz * size
    qx = origins[c, 0] + f[0, 0] * sx + f[0, 1] * sy + f[0, 2] * sz
    qy = origins[c, 1] + f[1, 0] * sx + f[1, 1] * sy + f[1, 2] * sz
    qz = origins[c, 2] + f[2, 0] * sx + f[2, 1] * sy + f[2, 2] * sz
    mx = f[0, 0] * nx + f[0, 1] * ny + f[0, 2] * nz
    my = f[1, 0] * nx + f[1, 1] * ny + f[1, 2] * nz
    mz = f[2, 0] * nx + f[2, 1] * ny + f[2, 2] * nz
    return qx, qy, qz, mx, my, mz, mx * (px - qx) + my * (py - qy) + mz * (pz - qz)


@compiled
def match_points(points, views, normals, surface, origins, frames, by_part):
    """Return the fields of `Matches` of measured points; beyond `FAR_M` there is no match, and the cone is 0.

    Args:
        points: shape (point_count, 3). views: unit vectors to their cameras. normals: measured ones, zero = unknown.
        by_part: return the distance to every part, or to the nearest only (in all columns).
    """
    count, cones = len(points), len(surface.body)
    best = np.zeros(count, np.int64)
    place = np.zeros((count, 3))
    normal = np.zeros((count, 3))
    offset = np.zeros(count)
    distance = np.full((count, PART_COUNT), FAR_M)
    middle = np.empty((cones, 3))
    reach = np.empty(cones)
    for c in range(cones):
        reach[c] = 0.5 * surface.length[c] + max(surface.start_radius[c], surface.end_radius[c]) * max(
            1.0, 1.0 / surface.flat[c]
        )
        for i in range(3):
            middle[c, i] = origins[c, i] + 0.5 * surface.length[c] * frames[c, i, 2]
    last = 0
    square = np.empty(PART_COUNT)
    for p in range(count):
        px, py, pz = points[p, 0], points[p, 1], points[p, 2]
        vx, vy, vz = views[p, 0], views[p, 1], views[p, 2]
        ux, uy, uz = normals[p, 0], normals[p, 1], normals[p, 2]
        known = ux != 0.0 or uy != 0.0 or uz != 0.0
        least = FAR_M * FAR_M
        square[:] = least
        for k in range(cones):
            c = last if k == 0 else (k - 1 if k <= last else k)  # try the neighbour's cone first
            part = surface.part[c]
            dx, dy, dz = px - middle[c, 0], py - middle[c, 1], pz - middle[c, 2]
            bound = np.sqrt(square[part] if by_part else least) + reach[c]
            if dx * dx + dy * dy + dz * dz > bound * bound:
                continue
            qx, qy, qz, nx, ny, nz, away = _match_cone(px, py, pz, vx, vy, vz, surface, origins, frames, c)
            cost = (px - qx) ** 2 + (py - qy) ** 2 + (pz - qz) ** 2
            if known:
                cost += NORMAL_COST_M2 * (1.0 - ux * nx - uy * ny - uz * nz)
            if cost < square[part]:
                square[part] = cost
            if cost < least:
                least = cost
                best[p] = c
                offset[p] = away
                place[p, 0], place[p, 1], place[p, 2] = qx, qy, qz
                normal[p, 0], normal[p, 1], normal[p, 2] = nx, ny, nz
        last = best[p]
        for part in range(PART_COUNT):
            distance[p, part] = np.sqrt(square[part] if by_part else least)
    return best, place, normal, offset, distance


@compiled
def offsets_from(points, views, cones, surface, origins, frames):
    """Return the signed distance of each point outside its matched cone [m]."""
    offsets = np.empty(len(points))
    for p in range(len(points)):
        offsets[p] = _match_cone(
            points[p, 0], points[p, 1], points[p, 2], views[p, 0], views[p, 1], views[p, 2],
            surface, origins, frames, cones[p],
        )[6]  # fmt: skip
    return offsets


@compiled
def points_cost(points, views, normals, elsewhere, surface, origins, frames, cones, cap):
    """Return the sum of the points' clipped squared distances to limb or rest, whichever is nearer, per candidate."""
    costs = np.zeros(len(origins))
    all_origins = np.zeros((len(surface.body), 3))
    all_frames = np.zeros((len(surface.body), 3, 3))
    for k in range(len(origins)):
        for n in range(len(cones)):
            all_origins[cones[n]] = origins[k, n]
            all_frames[cones[n]] = frames[k, n]
        for p in range(len(points)):
            least = min(elsewhere[p] * elsewhere[p], cap * cap)
            for c in cones:
                half = 0.5 * surface.length[c]
                reach = half + max(surface.start_radius[c], surface.end_radius[c])
                square = 0.0
                for i in range(3):
                    d = points[p, i] - all_origins[c, i] - half * all_frames[c, i, 2]
                    square += d * d
                if square > (reach + cap) ** 2:
                    continue
                qx, qy, qz, nx, ny, nz, _ = _match_cone(
                    points[p, 0], points[p, 1], points[p, 2], views[p, 0], views[p, 1], views[p, 2],
                    surface, all_origins, all_frames, c,
                )  # fmt: skip
                cost = (points[p, 0] - qx) ** 2 + (points[p, 1] - qy) ** 2 + (points[p, 2] - qz) ** 2
                if normals[p, 0] != 0.0 or normals[p, 1] != 0.0 or normals[p, 2] != 0.0:
                    cost += NORMAL_COST_M2 * (
                        1.0 - normals[p, 0] * nx - normals[p, 1] * ny - normals[p, 2] * nz
                    )
                least = min(least, cost)
            costs[k] += least
    return costs
