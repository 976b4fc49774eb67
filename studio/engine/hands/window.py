"""The part of a depth image around a hand, laid out along the forearm, in units of the forearm's length."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from studio.engine.depth import DepthCamera, project

ROWS, COLUMNS = 24, 20
"""Samples along the forearm, from before the wrist to beyond the finger tips, and across it."""

_ALONG = np.linspace(-0.30, 0.95, ROWS)
_ACROSS = np.linspace(-0.50, 0.50, COLUMNS)
_PALM = 0.30
"""The palm lies this far beyond the wrist, in forearms."""
_NEAR_PALM, _BAND = 0.22, 0.65
_LEAST_SEEN = 6

Array = NDArray[np.float64]


@dataclass(frozen=True)
class HandWindow:
    """Samples around a hand; the first axis runs from the forearm to the finger tips.

    Attributes:
        filled: share of the sample that lies at the hand's depth, 0..1, shape (ROWS, COLUMNS).
        nearer: how much nearer than the hand it is, in forearms; 0 where it is not filled; same shape.
        along_ray: cosine between forearm and viewing direction; 1 = it points away from the camera.
        forearm_px: length of the forearm at the hand's distance [pixels].
        distance_m: of the hand.
    """

    filled: Array
    nearer: Array
    along_ray: float
    forearm_px: float
    distance_m: float


def hand_window(
    camera: DepthCamera,
    depth_mm: NDArray[np.uint16],
    wrist: Array,
    elbow: Array,
    forearm_m: float,
    *,
    mirrored: bool,
) -> HandWindow | None:
    """Return the window around a hand, or None where the image shows nothing at its place.

    Args:
        camera: of the image.
        depth_mm: the image, shape (H, W).
        wrist, elbow: in the camera frame [m], shape (3,).
        forearm_m: length of the forearm, which is steadier than the distance of the two.
        mirrored: of a right hand, which then looks like a left one.
    """
    way = wrist - elbow
    length = float(np.linalg.norm(way))
    if not np.isfinite(length) or length < 1e-3 or wrist[2] < 0.2 or forearm_m < 0.05:
        return None
    way = way / length
    palm = wrist + _PALM * forearm_m * way
    pixel_m = max(palm[2], 0.2) / camera.fx
    place = project(camera, palm)
    distance_m = _distance(depth_mm, place, palm[2], forearm_m, pixel_m)
    if distance_m is None:
        return None
    pixel_m = distance_m / camera.fx
    flat = float(np.hypot(way[0], way[1]))
    axis = way[:2] / flat if flat > 0.2 else np.array([0.0, -1.0])
    side = np.array([-axis[1], axis[0]]) * (-1.0 if mirrored else 1.0)
    grid = ((_ALONG[:, None, None] - _PALM) * axis + _ACROSS[None, :, None] * side) * (
        forearm_m / pixel_m
    ) + place
    filled, nearer = _sample(depth_mm, grid, distance_m, forearm_m)
    shift = _lateral(filled)
    if shift is not None:
        grid = grid + shift * side * (forearm_m / pixel_m)
        filled, nearer = _sample(depth_mm, grid, distance_m, forearm_m)
    ray = palm / np.linalg.norm(palm)
    return HandWindow(filled, nearer, float(way @ ray), forearm_m / pixel_m, distance_m)


def _distance(
    depth_mm: NDArray[np.uint16], place: Array, z: float, forearm_m: float, pixel_m: float
) -> float | None:
    """Return the distance of what lies at the palm's place [m]; None where nothing does."""
    radius = max(_NEAR_PALM * forearm_m / pixel_m, 1.5)
    low = np.floor(place - radius).astype(int)
    high = np.ceil(place + radius).astype(int) + 1
    rows = slice(max(low[1], 0), max(high[1], 0))
    patch = depth_mm[rows, max(low[0], 0) : max(high[0], 0)].ravel() * 1e-3
    near = patch[np.abs(patch - z) < _BAND * forearm_m]
    return float(np.median(near)) if len(near) >= _LEAST_SEEN else None


def _sample(
    depth_mm: NDArray[np.uint16], grid: Array, distance_m: float, forearm_m: float
) -> tuple[Array, Array]:
    """Return share filled and nearness at the places of a grid, shape (ROWS, COLUMNS, 2), between pixels."""
    first = np.floor(grid).astype(int)
    part = grid - first
    filled = np.zeros(grid.shape[:2])
    nearer = np.zeros(grid.shape[:2])
    for right in (0, 1):
        for down in (0, 1):
            columns, rows = first[..., 0] + right, first[..., 1] + down
            inside = (columns >= 0) & (columns < depth_mm.shape[1]) & (rows >= 0) & (rows < depth_mm.shape[0])
            z = depth_mm[np.where(inside, rows, 0), np.where(inside, columns, 0)] * 1e-3
            offset = (distance_m - z) / forearm_m
            weight = np.abs(1 - right - part[..., 0]) * np.abs(1 - down - part[..., 1])
            weight = weight * (inside & (z > 0) & (np.abs(offset) < _BAND))
            filled += weight
            nearer += weight * offset
    return filled, np.where(filled > 0, nearer / np.maximum(filled, 1e-9), 0.0)


def _lateral(filled: Array) -> float | None:
    """How far beside the axis the hand lies, in forearms; None where it cannot be told."""
    rows = filled[ROWS // 4 : 3 * ROWS // 4]
    total = rows.sum()
    return float(np.clip((rows @ _ACROSS).sum() / total, -0.2, 0.2)) if total > 4 else None
