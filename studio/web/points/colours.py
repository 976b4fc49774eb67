"""Colours of points: the solve's confidence in the joint nearest to each."""

import numpy as np
from numpy.typing import NDArray

from studio.web.scene.palette import confidence_colours

REACH_M = 0.30
"""Maximum distance of the performer's points from a joint [m]: skin between two joints lies within 0.25 m of one."""

NOBODY_RGB = (138, 146, 156)


def by_confidence(
    points_m: NDArray[np.float32], joints_m: NDArray[np.float64], confidence: NDArray[np.float64]
) -> NDArray[np.uint8]:
    """Return RGB of points, shape (N, 3): the nearest joint's confidence, grey if none is within `REACH_M`.

    Args:
        points_m: stage frame [m], shape (N, 3).
        joints_m: shape (J, 3), stage frame [m]; NaN = unknown. confidence: 0 to 1, shape (J,).
    """
    colours = np.tile(np.array(NOBODY_RGB, dtype=np.uint8), (len(points_m), 1))
    known = np.isfinite(joints_m).all(axis=1)
    if not known.any() or not len(points_m):
        return colours
    joints = joints_m[known].astype(np.float32)
    squared = (joints**2).sum(axis=1) - 2.0 * (points_m @ joints.T)  # without the points' own squares
    nearest = squared.argmin(axis=1)
    away = squared[np.arange(len(points_m)), nearest] + (points_m**2).sum(axis=1)
    near = away < REACH_M**2
    colours[near] = confidence_colours(confidence[known])[nearest[near]]
    return colours
