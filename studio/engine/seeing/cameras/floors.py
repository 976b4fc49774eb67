"""The floor that a camera sees, which shows the camera's height and tilt."""

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from studio.engine.base.geometry import transform_points
from studio.engine.model.cameras.depth import DepthCamera, DepthFrame, points
from studio.engine.seeing.images.floor import find_floor

Array = NDArray[np.float64]
_AHEAD_M, _ASIDE_M = (1.5, 4.0), (1.0, -1.0)


def floor_of(frames: Iterable[DepthFrame], name: str, camera: DepthCamera) -> Array | None:
    """Return a camera's floor in its own frame, (unit normal, offset), from its first image; None = not found."""
    image = next((frame for frame in frames if frame.camera == name), None)
    if image is None:
        return None
    cloud = points(camera, image.depth_mm).reshape(-1, 3).astype(np.float64)
    return find_floor(np.ascontiguousarray(cloud[cloud[:, 2] > 0][::31]), np.array([0.0, -1.0, 0.0]))


def floor_corners(T_stage_camera: Array, floor: Array) -> Array:
    """Return four places of the floor in front of a camera, 2 m wide and 1.5 to 4 m away [m], shape (4, 3).

    Args:
        T_stage_camera: camera points to the stage, shape (4, 4).
        floor: see `floor_of`.
    """
    ahead = T_stage_camera[:3, 2]
    foot = transform_points(T_stage_camera, floor[:3] * floor[3])
    flat = np.array([ahead[0], ahead[1], 0.0]) / max(np.hypot(ahead[0], ahead[1]), 1e-6)
    side = np.array([-flat[1], flat[0], 0.0])
    spots = np.array([foot + far * flat + aside * side for far in _AHEAD_M for aside in _ASIDE_M])
    up = T_stage_camera[:3, :3] @ floor[:3]
    return spots - ((spots - foot) @ up)[:, None] * up
