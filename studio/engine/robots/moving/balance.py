"""Balance: the centre of mass over the support, while a performer stands."""

import numpy as np
from numpy.typing import NDArray

from studio.engine.robots.body.robot import INDEX
from studio.engine.robots.moving.kinematics import Linearised
from studio.engine.robots.moving.targets import SOLES, Targets

Array = NDArray[np.float64]

SLOW_M_S = 0.2
"""A performer with a foot on the floor and hips slower than this stands; a walking one falls from step to step."""

INSIDE_M = 0.015
"""A solve keeps the centre of mass this far inside the support."""

SIGMA_M, MOST_M = 0.004, 0.1
"""Deviation of the centre of mass from there, and the largest distance by which it is pulled: feet stay in place
where a robot would have to fall."""


def standing_frames(targets: Targets) -> NDArray[np.bool_]:
    """Frames in which the performer stands: slow, with a foot on the floor, shape (frame_count,)."""
    hips = targets.points_m[:, [INDEX["left_hip"], INDEX["right_hip"]]].mean(axis=1)
    speed = np.linalg.norm(np.gradient(hips[:, :2], targets.frame_s, axis=0), axis=1)
    return (speed < SLOW_M_S) & targets.standing.any(axis=(1, 2))


def outside(mass: Array, soles: Array, standing: NDArray[np.bool_], inside_m: float = 0.0) -> Array:
    """Return the shortest vector on the floor from each centre of mass into its support [m], shape (frame_count, 2).

    Args:
        mass: centres of mass, shape (frame_count, 3).
        soles: corners, shape (frame_count, 2, 4, 3).
        standing: which corners stand, shape (frame_count, 2, 4).
        inside_m: margin by which the support is shrunk.
    """
    out = np.zeros((len(mass), 2))
    for t in np.flatnonzero(standing.any(axis=(1, 2))):
        out[t] = _way_in(mass[t, :2], soles[t][standing[t]][:, :2], inside_m)
    return out


def _way_in(point: Array, corners: Array, inside_m: float) -> Array:
    hull = _hull(corners)
    if len(hull) < 3:
        nearest = hull.mean(axis=0)
        return nearest - point
    middle = hull.mean(axis=0)
    radius = np.linalg.norm(hull - middle, axis=1).min()
    hull = middle + (hull - middle) * max(1.0 - inside_m / max(float(radius), 1e-6), 0.1)
    edge = np.roll(hull, -1, axis=0) - hull
    to = point - hull
    if (edge[:, 0] * to[:, 1] - edge[:, 1] * to[:, 0] >= 0.0).all():
        return np.zeros(2)
    share = np.clip((to * edge).sum(axis=1) / np.maximum((edge**2).sum(axis=1), 1e-12), 0.0, 1.0)
    nearest = hull + share[:, None] * edge
    return nearest[np.argmin(((nearest - point) ** 2).sum(axis=1))] - point


def _hull(points: Array) -> Array:
    """The convex hull of points on a plane, anticlockwise (Andrew's monotone chain)."""
    ordered = points[np.lexsort((points[:, 1], points[:, 0]))]
    halves = []
    for run in (ordered, ordered[::-1]):
        half: list[Array] = []
        for point in run:
            while len(half) > 1 and _turn(half[-2], half[-1], point) <= 1e-12:
                half.pop()
            half.append(point)
        halves += half[:-1]
    return np.array(halves) if len(halves) else ordered[:1]


def _turn(a: Array, b: Array, c: Array) -> float:
    return float((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]))


def balance_rows(at: Linearised, targets: Targets) -> tuple[NDArray[np.int64], Array, Array]:
    """Return rows that pull the centre of mass over the support where the performer stands; see `add_rows`."""
    assert at.mass_jacobians is not None
    stands = targets.standing & standing_frames(targets)[:, None, None]
    way = outside(at.mass_m, at.points_m[:, SOLES], stands, INSIDE_M)
    way *= np.minimum(1.0, MOST_M / np.maximum(np.linalg.norm(way, axis=1, keepdims=True), 1e-9))
    frames = np.flatnonzero((way != 0.0).any(axis=1))
    rows = at.mass_jacobians[frames, :2].reshape(-1, at.mass_jacobians.shape[2])
    return np.repeat(frames, 2), rows / SIGMA_M, way[frames].ravel() / SIGMA_M
