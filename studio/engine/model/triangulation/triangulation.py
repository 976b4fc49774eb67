"""Places of points from several cameras: least squares over rays and points, with weights that fall with distance.

Source: the midpoint of rays (Hartley, Sturm, "Triangulation", Computer Vision and Image Understanding 68, 1997),
reweighted iteratively by Cauchy's weights (Holland, Welsch, "Robust regression using iteratively reweighted
least-squares", Communications in Statistics 6, 1977).
"""

import math

import numpy as np
from numpy.typing import NDArray

from studio.engine.base.compiled import compiled
from studio.engine.model.triangulation.guess import NEAREST_M

Array = NDArray[np.float64]

CAUCHY = 2.0
ROUNDS = 6
"""Residual, in usual errors, from which a weight falls, and rounds of reweighting."""

_RIDGE = 1e-9
"""Share of the information that is added to every direction, so that parallel rays have a place too."""


def triangulate(
    ends: Array,
    errors: Array,
    centres: Array,
    rays: NDArray[np.bool_],
    *,
    least_angle_rad: float = 0.0,
    cauchy: float = CAUCHY,
    rounds: int = ROUNDS,
) -> Array:
    """Return the places of points [m], shape (point_count, 3); NaN where neither a point nor two rays are seen.

    Args:
        ends: any point on the ray, or the point of a camera that sees depth [m], shape (camera_count, point_count,
            3); NaN = unseen.
        errors: usual error, shape (camera_count, point_count): for a ray across it, per metre of distance; for a
            point in metres.
        centres: optical centres [m], shape (camera_count, 3).
        rays: the cameras that see no depth, shape (camera_count,).
        least_angle_rad: rays alone must meet at a larger angle.
        cauchy: see `CAUCHY`.
        rounds: see `ROUNDS`.
    """
    return _triangulated(ends, errors, centres, rays, math.sin(least_angle_rad), cauchy, rounds)


@compiled
def _triangulated(
    ends: Array,
    errors: Array,
    centres: Array,
    rays: NDArray[np.bool_],
    least_sine: float,
    cauchy: float,
    rounds: int,
) -> Array:
    cameras, count = errors.shape
    places = np.full((count, 3), np.nan)
    directions, seen = np.empty((cameras, 3)), np.empty(cameras, dtype=np.bool_)
    matrix, side = np.empty((3, 3)), np.empty(3)
    for k in range(count):
        points = 0
        for c in range(cameras):
            seen[c] = ends[c, k, 0] == ends[c, k, 0]
            points += 1 if seen[c] and not rays[c] else 0
            length = 0.0
            for a in range(3):
                directions[c, a] = ends[c, k, a] - centres[c, a]
                length += directions[c, a] ** 2
            for a in range(3):
                directions[c, a] /= math.sqrt(length)
        if points == 0 and not _meet(directions, seen, least_sine):
            continue
        for n in range(rounds):
            matrix[:], side[:] = 0.0, 0.0
            for c in range(cameras):
                if not seen[c]:
                    continue
                distance, off = 1.0, 0.0
                if n > 0:
                    along = 0.0
                    for a in range(3):
                        along += directions[c, a] * (places[k, a] - centres[c, a])
                    distance = max(along, NEAREST_M)
                    for a in range(3):
                        at = centres[c, a] + along * directions[c, a] if rays[c] else ends[c, k, a]
                        off += (places[k, a] - at) ** 2
                usual = errors[c, k] * distance if rays[c] else errors[c, k]
                weight = 1.0 / (usual * usual)
                if n > 0:
                    weight /= 1.0 + off * weight / (cauchy * cauchy)
                for a in range(3):
                    for b in range(3):
                        across = (1.0 if a == b else 0.0) - (
                            directions[c, a] * directions[c, b] if rays[c] else 0.0
                        )
                        matrix[a, b] += weight * across
                        side[a] += weight * across * (centres[c, b] if rays[c] else ends[c, k, b])
            ridge = _RIDGE * (matrix[0, 0] + matrix[1, 1] + matrix[2, 2])
            for a in range(3):
                matrix[a, a] += ridge
            _solve(matrix, side, places[k])
    return places


@compiled
def _solve(matrix: Array, side: Array, out: Array) -> None:
    """Solve three equations whose matrix is symmetric and positive, by Cholesky's factors."""
    a = math.sqrt(matrix[0, 0])
    b, c = matrix[0, 1] / a, matrix[0, 2] / a
    d = math.sqrt(matrix[1, 1] - b * b)
    e = (matrix[1, 2] - b * c) / d
    f = math.sqrt(matrix[2, 2] - c * c - e * e)
    x = side[0] / a
    y = (side[1] - b * x) / d
    out[2] = (side[2] - c * x - e * y) / f / f
    out[1] = (y - e * out[2]) / d
    out[0] = (x - b * out[1] - c * out[2]) / a


@compiled
def _meet(directions: Array, seen: NDArray[np.bool_], least_sine: float) -> bool:
    """Whether any two of the seen rays meet at an angle that is large enough."""
    for c in range(len(directions)):
        for d in range(c):
            if seen[c] and seen[d]:
                cross = 0.0
                for a in range(3):
                    b, e = (a + 1) % 3, (a + 2) % 3
                    cross += (directions[c, b] * directions[d, e] - directions[c, e] * directions[d, b]) ** 2
                if cross >= least_sine**2:
                    return True
    return False
