"""The distance from which a camera's picture contains given points."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Look:
    """A camera's position, and the point in the middle of its picture, stage frame [m], shape (3,) each."""

    position_m: Array
    target_m: Array


def axes_towards(direction: Array) -> Array:
    """Return right, up and forward of a camera that looks back along `direction`, z up; rows, shape (3, 3)."""
    forward = -direction / np.linalg.norm(direction)
    right = np.cross(forward, [0.0, 0.0, 1.0])
    right /= max(float(np.linalg.norm(right)), 1e-9)
    return np.stack([right, np.cross(right, forward), forward])


def fit(points_m: Array, direction: Array, *, fov_rad: float, aspect: float, margin: float = 1.08) -> Look:
    """Return the nearest look along a direction whose picture contains all points.

    Args:
        points_m: shape (point_count, 3).
        direction: from the points to the camera, any length, not straight up, shape (3,).
        fov_rad: vertical angle of view; aspect: width over height.
        margin: factor of the picture's size, at least 1.
    """
    axes = axes_towards(np.asarray(direction, dtype=float))
    places = points_m @ axes.T
    slopes = np.array([np.tan(fov_rad / 2) * aspect, np.tan(fov_rad / 2)]) / margin
    # A point at depth z is inside where |place - centre| <= slope * (z - eye): each side bounds the eye's depth.
    low = (places[:, :2] + slopes * places[:, 2:]).min(axis=0)
    high = (places[:, :2] - slopes * places[:, 2:]).max(axis=0)
    eye_depths = (low - high) / (2.0 * slopes)
    eye_depth = float(min(eye_depths.min(), places[:, 2].min() - 0.2))
    centre = (low + high) / 2.0
    eye = np.array([*centre, eye_depth])
    target = np.array([*centre, places[:, 2].mean()])
    return Look(eye @ axes, target @ axes)
