"""The floor seen by depth cameras, combined over images and cameras."""

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from studio.engine.base.geometry import transform_points
from studio.engine.calibration.performer.floor import Floor
from studio.engine.model.cameras.depth import DepthCamera, points
from studio.engine.seeing.images.floor import find_floor

_POINTS = 6000
_UP = np.array([0.0, -1.0, 0.0])

MAX_TILT_DEG = 8.0
MAX_HEIGHT_M = 0.15
"""A plane farther than this from the one under the feet is not the floor, but a table, a bed or a step."""


def seen_floors(
    views: Mapping[str, tuple[DepthCamera, Sequence[NDArray[np.uint16]]]],
) -> dict[str, Floor]:
    """Return each camera's floor in its own frame, the median over its images; cameras without one are left out.

    Args:
        views: by camera, intrinsics and depth images [mm], uint16, shape (height, width); 0 = no reading.
    """
    out = {}
    for name, (camera, images) in views.items():
        planes = [plane for image in images if (plane := _plane(camera, image)) is not None]
        if len(planes) > len(images) // 2:
            middle = np.median(planes, axis=0)
            length = float(np.linalg.norm(middle[:3]))
            out[name] = Floor(middle[:3] / length, float(middle[3]) / length)
    return out


def _plane(camera: DepthCamera, depth_mm: NDArray[np.uint16]) -> NDArray[np.float64] | None:
    cloud = points(camera, depth_mm).reshape(-1, 3).astype(np.float64)
    cloud = cloud[cloud[:, 2] > 0]
    return find_floor(np.ascontiguousarray(cloud[:: max(len(cloud) // _POINTS, 1)]), _UP)


def common_floor(
    floors: Mapping[str, Floor], poses: Mapping[str, NDArray[np.float64]], around: NDArray[np.float64]
) -> Floor | None:
    """Return one floor from those of several cameras; None where there is none.

    Args:
        floors: by camera, in its own frame.
        poses: by camera, 4x4, camera points to the common frame.
        around: the place in the common frame where the floors are compared [m], shape (3,).
    """
    ups, feet = [], []
    for name, floor in floors.items():
        if name in poses:
            up = poses[name][:3, :3] @ floor.up
            on_floor = transform_points(poses[name], floor.up * floor.height_m)
            ups.append(up)
            feet.append(around - (up @ (around - on_floor)) * up)
    if not ups:
        return None
    up = np.median(ups, axis=0)
    up /= np.linalg.norm(up)
    return Floor(up, float(up @ np.median(feet, axis=0)))


def is_floor(seen: Floor, under_feet: Floor, around: NDArray[np.float64]) -> bool:
    """Whether a plane may be the floor that the feet stood on, at a place in the same frame [m], shape (3,)."""
    tilt_deg = float(np.degrees(np.arccos(np.clip(seen.up @ under_feet.up, -1.0, 1.0))))
    apart_m = float(abs((seen.up @ around - seen.height_m) - (under_feet.up @ around - under_feet.height_m)))
    return tilt_deg <= MAX_TILT_DEG and apart_m <= MAX_HEIGHT_M
