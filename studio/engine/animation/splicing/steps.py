"""Feet in a seam: each moves from its place in the first part to its place in the second in one step.

Before and after its step a foot is at its place in that part, so that standing feet stay. A foot that stands at
different places in both parts is lifted on its way. The times of the steps minimise dragging over the floor, frames
without a standing foot, and acceleration.
"""

from itertools import product

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

LEAST_STEP = 0.45
"""Shortest step as a share of the seam."""

LIFT_SHARE, MOST_LIFT_M = 0.3, 0.08
"""Lift of a step as a share of the distance dragged without it, and the largest lift [m]."""

CHOICES = 7
"""Number of candidates for the start, and for the end, of a step."""

DRAGGED, HANGING, SUDDEN = 1.0, 0.02, 0.004
"""Costs of a metre dragged over the floor, of a frame in which no foot stands although one does in both parts, and
of each m/s2 of the largest acceleration."""


def smooth_step(share: Array) -> Array:
    """Return a step from 0 to 1 over 0..1 with continuous velocity and acceleration, constant outside."""
    t = np.clip(share, 0.0, 1.0)
    return t * t * t * (10.0 + t * (6.0 * t - 15.0))


def steps_between(
    first: Array, second: Array, stands: tuple[NDArray[np.bool_], NDArray[np.bool_]], dt: float
) -> Array:
    """Return the feet's places in a seam [m], shape (frame_count, 4, 3).

    Args:
        first, second: ankle and toe of the left and the right foot in the parts before and after, shape
            (frame_count, 4, 3); the frame before the seam is the first part's, the one after it the second's.
        stands: which feet stand in each part, shape (frame_count, 2).
        dt: time between frames [s].
    """
    choices = [_choices(first[:, k : k + 2], second[:, k : k + 2], stands, k // 2, dt) for k in (0, 2)]
    left, right = min(product(*choices), key=lambda pair: _cost(pair, stands))
    return np.concatenate([left.path, right.path], axis=1)


class _Step:
    """One foot's path through the seam.

    Attributes:
        path: of ankle and toe [m], shape (frame_count, 2, 3).
        cost: of the foot alone.
        supports: whether it stands at its place in one of the parts, shape (frame_count,).
    """

    def __init__(
        self, first: Array, second: Array, on_floor: tuple[Array, Array], share: Array, dt: float
    ) -> None:
        part = share[:, None, None]
        path = (1.0 - part) * first + part * second
        way = np.linalg.norm(np.diff(path[:, 0, :2], axis=0, prepend=path[:1, 0, :2]), axis=1)
        own = np.gradient(first[:, 0, :2], axis=0), np.gradient(second[:, 0, :2], axis=0)
        needed = (1.0 - share) * np.linalg.norm(own[0], axis=1) + share * np.linalg.norm(own[1], axis=1)
        low = (1.0 - share) * on_floor[0] + share * on_floor[1]
        dragged = float((np.maximum(way - needed, 0.0) * low).sum())
        path[:, :, 2] += (min(LIFT_SHARE * dragged, MOST_LIFT_M) * _arc(share))[:, None]
        whole = np.concatenate([first[:1], path, second[-1:]])[:, 0]
        sudden = np.linalg.norm(np.diff(whole, n=2, axis=0), axis=1).max() / dt**2
        self.path, self.cost = path, DRAGGED * dragged + SUDDEN * float(sudden)
        self.supports = ((share <= 0.0) & (on_floor[0] > 0)) | ((share >= 1.0) & (on_floor[1] > 0))


def _choices(
    first: Array, second: Array, stands: tuple[NDArray[np.bool_], NDArray[np.bool_]], foot: int, dt: float
) -> list[_Step]:
    count = len(first)
    on_floor = stands[0][:, foot].astype(np.float64), stands[1][:, foot].astype(np.float64)
    frames, edges = np.arange(1, count + 1), np.linspace(0.0, count + 1.0, CHOICES)
    return [
        _Step(first, second, on_floor, smooth_step((frames - begin) / (end - begin)), dt)
        for begin, end in product(edges, edges)
        if end - begin >= LEAST_STEP * (count + 1)
    ]


def _cost(pair: tuple[_Step, ...], stands: tuple[NDArray[np.bool_], NDArray[np.bool_]]) -> float:
    """Cost of both feet's steps together."""
    held = stands[0].any(axis=1) & stands[1].any(axis=1)
    hanging = held & ~(pair[0].supports | pair[1].supports)
    return sum(step.cost for step in pair) + HANGING * float(hanging.sum())


def _arc(share: Array) -> Array:
    """Height over the course of a step, 0..1, smooth at both ends."""
    return 64.0 * (share * (1.0 - share)) ** 3
