"""A body guessed from one picture: posture by a pose network, place by its size in the picture."""

import numpy as np
from numpy.typing import NDArray

from studio.engine.model.cameras.lens import Lens, usual_lens
from studio.engine.model.frames import CameraFrame, PictureJoints

Array = NDArray[np.float64]

GUESSED_HEIGHT_M = 1.7
"""Stature of the bodies that pose networks guess from a picture."""

NEAREST_M = 0.2
LEAST_VISIBLE = 0.3
LEAST_SEEN = 6
"""Lowest confidence of a joint that counts for the place, and least number of such joints."""


def camera_joints(frame: CameraFrame) -> Array:
    """Return a frame's joints in the camera frame [m], shape (21, 3); those of a camera without depth are guessed."""
    picture = frame.picture
    if picture is None:
        return frame.positions
    return guessed_joints(picture, frame.confidence, usual_lens(picture.width, picture.height))


def guessed_joints(picture: PictureJoints, confidence: Array, lens: Lens, scale: float = 1.0) -> Array:
    """Return the joints in the camera frame, guessed from one picture [m], shape (21, 3); NaN = unknown.

    The body's place is found by linear least squares over the visible joints. Each joint then lies on its ray at its
    depth.

    Args:
        picture: with `world_m`.
        confidence: shape (21,).
        lens: of the picture.
        scale: the performer's size relative to the one that the guess assumes.
    """
    rays = lens.rays_of(picture.pixels)
    body = picture.world_m * scale
    used = (confidence > LEAST_VISIBLE) & ~np.isnan(rays[:, 0]) & ~np.isnan(body[:, 0])
    if used.sum() < LEAST_SEEN:
        return np.full((len(rays), 3), np.nan)
    rows, sides = shift_equations(body[used], rays[used])
    weights = np.tile(confidence[used], 2)
    place, *_ = np.linalg.lstsq(rows * weights[:, None], sides * weights, rcond=None)
    depth = body[:, 2] + place[2]
    depth = np.where(depth > NEAREST_M, depth, np.nan)
    return np.column_stack([rays * depth[:, None], depth])


def shift_equations(points: Array, rays: Array) -> tuple[Array, Array]:
    """Return the linear equations of the shift t that puts points on rays: `x + tx = u (z + tz)`, then y with v.

    Args:
        points: in the camera frame [m], shape (n, 3).
        rays: u = x/z and v = y/z, shape (n, 2).

    Returns:
        Rows, shape (2n, 3), and right sides, shape (2n,): first all of x, then all of y.
    """
    rows = np.zeros((2, len(points), 3))
    rows[0, :, 0] = rows[1, :, 1] = 1.0
    rows[:, :, 2] = -rays.T
    return rows.reshape(-1, 3), (rays * points[:, 2:] - points[:, :2]).T.ravel()
