"""The floor in one camera's image: a plane among the points, found without the camera's pose."""

import numpy as np
from numpy.typing import NDArray

from studio.engine.base.compiled import compiled
from studio.engine.base.geometry import make_transform, rotation_between

Array = NDArray[np.float64]

_TOLERANCE = 0.03
_MAX_TILT_COSINE = 0.35
"""Largest angle between the floor's normal and the image's up: 70 degrees."""
_MIN_SHARE = 0.06
_TRIALS = 400


@compiled
def _best_plane(points, up, trials, tolerance, tilt):
    """Return the plane (unit normal, offset: normal @ p = offset) with many points near it and few below it, and its
    score; random triples come from a fixed sequence.
    """
    count = len(points)
    state = np.uint64(0x2545F4914F6CDD1D)
    best = np.zeros(4)
    best_score = 0
    index = np.zeros(3, np.int64)
    for _ in range(trials):
        for k in range(3):
            state ^= state << np.uint64(13)
            state ^= state >> np.uint64(7)
            state ^= state << np.uint64(17)
            index[k] = np.int64(state % np.uint64(count))
        a, b, c = points[index[0]], points[index[1]], points[index[2]]
        ux, uy, uz = b[0] - a[0], b[1] - a[1], b[2] - a[2]
        vx, vy, vz = c[0] - a[0], c[1] - a[1], c[2] - a[2]
        nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
        length = np.sqrt(nx * nx + ny * ny + nz * nz)
        if length < 1e-3:
            continue
        nx, ny, nz = nx / length, ny / length, nz / length
        upward = nx * up[0] + ny * up[1] + nz * up[2]
        if upward < 0:
            nx, ny, nz, upward = -nx, -ny, -nz, -upward
        if upward < tilt:
            continue
        offset = nx * a[0] + ny * a[1] + nz * a[2]
        score = 0
        for p in points:
            height = nx * p[0] + ny * p[1] + nz * p[2] - offset
            if abs(height) < tolerance:
                score += 1
            elif height < -2 * tolerance:
                score -= 2
        if score > best_score:
            best_score = score
            best[0], best[1], best[2], best[3] = nx, ny, nz, offset
    return best, best_score


def find_floor(points: Array, up: Array) -> Array | None:
    """Return the floor as (unit normal, offset), shape (4,): normal @ p = offset; None where there is none.

    Args:
        points: of one image [m], shape (point_count, 3), about 2,000.
        up: rough direction upwards, unit, shape (3,).

    Source: Fischler & Bolles, "Random sample consensus", CACM 1981. Points below the plane count against it, so that
    a table or a bed is not taken for the floor.
    """
    if len(points) < 100:
        return None
    plane, score = _best_plane(points, up, _TRIALS, _TOLERANCE, _MAX_TILT_COSINE)
    if score < _MIN_SHARE * len(points):
        return None
    for _ in range(3):
        near = points[np.abs(points @ plane[:3] - plane[3]) < _TOLERANCE]
        centre = near.mean(axis=0)
        normal = np.linalg.svd(near - centre, full_matrices=False)[2][2]
        normal = normal if normal @ plane[:3] > 0 else -normal
        plane = np.array([*normal, normal @ centre])
    return plane


def stand_on(plane: Array) -> Array:
    """Return `T_work_camera`: z is the floor's normal, the origin is the point of the floor under the camera, and y
    points away from the camera. A person who faces the camera faces -y, as on the stage.
    """
    rotation = rotation_between(plane[:3], np.array([0.0, 0.0, 1.0]))
    ahead = rotation @ np.array([0.0, 0.0, 1.0])
    if np.hypot(ahead[0], ahead[1]) < 1e-6:
        ahead = rotation @ np.array([0.0, -1.0, 0.0])
    turn = np.pi / 2 - np.arctan2(ahead[1], ahead[0])
    c, s = np.cos(turn), np.sin(turn)
    rotation = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]]) @ rotation
    return make_transform(rotation, np.array([0.0, 0.0, -plane[3]]))
