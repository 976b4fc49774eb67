"""The space of a motion as a few points, for a page that shows all of it."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

_AROUND_M = 0.12
"""Extent of a body beyond its joints [m]."""

_DIRECTIONS = 300


def space_of(joints_m: Array) -> Array:
    """Return outermost points of the bodies with joints at these places, and of the floor below them.

    Any view that contains them contains the bodies, to about a percent of their extent. Points that are not finite
    are left out; without any the result is empty.

    Args:
        joints_m: stage frame [m], shape (N, 3).

    Returns:
        Points, shape (M, 3), M at most 304.
    """
    joints = joints_m[np.isfinite(joints_m).all(axis=1)]
    if not len(joints):
        return np.zeros((0, 3))
    directions = _evenly(_DIRECTIONS)
    outermost = np.array([joints[(joints @ direction).argmax()] for direction in directions])
    low, high = joints.min(axis=0), joints.max(axis=0)
    ground = np.array([[x, y, 0.0] for x in (low[0], high[0]) for y in (low[1], high[1])])
    return np.unique(np.concatenate([outermost + np.sign(directions) * _AROUND_M, ground]).round(3), axis=0)


def _evenly(count: int) -> Array:
    """Return directions spread evenly over the sphere (a Fibonacci lattice), shape (count, 3)."""
    i = np.arange(count) + 0.5
    z, turn = 1.0 - 2.0 * i / count, np.pi * (1.0 + np.sqrt(5.0)) * i
    flat = np.sqrt(1.0 - z**2)
    return np.stack([flat * np.cos(turn), flat * np.sin(turn), z], axis=1)
