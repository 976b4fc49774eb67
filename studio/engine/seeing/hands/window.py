"""The part of a depth image around a hand, aligned with the forearm, in units of the forearm's length."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from studio.engine.model.cameras.depth import DepthCamera
from studio.engine.seeing.images.depth_window import sampled

SIDE = 28
"""Samples along the forearm, to the finger tips, and across it; the palm lies in the middle."""

CHANNELS, ABOUT = 4, 4
"""Numbers of a sample, and of the whole window; see `HandWindow`."""

_STEP = 0.042
"""Distance between samples, in forearms: a centimetre."""
_PLACES = (np.arange(SIDE) - 0.5 * (SIDE - 1)) * _STEP
_PALM = 0.30
"""Distance of the palm beyond the wrist, in forearms."""
_BAND = 0.40
"""Half depth of the hand's band, in forearms. Points outside belong to something else, most often the trunk."""
_ABOUT_PALM, _SEARCHED, _THICK = 0.22, 0.6, 0.22
_NEAREST_PERCENT = 25.0
_LEAST_SEEN = 4
_MOST_ALONG, _MOST_ASIDE = 0.8, 0.2
_CORE = slice(8, 22)
_LEAST_CORE = 4.0

Array = NDArray[np.float64]


@dataclass(frozen=True)
class HandWindow:
    """Samples around a hand; the first axis runs from the forearm to the finger tips.

    Attributes:
        samples: shape (SIDE, SIDE, CHANNELS): the share at the hand's depth, its distance in front of the hand
            (1 = `_BAND`), the share without a reading, and its position along the forearm beyond the palm
            in space, in forearms; all 0 where nothing is at the hand's depth.
        about: shape (ABOUT,): the cosine between forearm and viewing ray (1 = it points away from the camera), the
            forearm's length in pixels and the distance, scaled, and the distance of the found hand beyond the tracked
            palm, in forearms.
    """

    samples: NDArray[np.float32]
    about: NDArray[np.float32]


def hand_window(
    camera: DepthCamera,
    depth_mm: NDArray[np.uint16],
    wrist: Array,
    elbow: Array,
    forearm_m: float,
    *,
    mirrored: bool,
) -> HandWindow | None:
    """Return the window around a hand, or None if the image shows nothing at its place.

    Args:
        camera: of the image.
        depth_mm: the image, shape (H, W).
        wrist, elbow: in the camera frame [m], shape (3,).
        forearm_m: length of the forearm, which is steadier than the distance of the two.
        mirrored: mirror a right hand, so that it looks like a left one.
    """
    way = wrist - elbow
    length = float(np.linalg.norm(way))
    if not np.isfinite(length) or length < 1e-3 or wrist[2] < 0.2 or forearm_m < 0.05:
        return None
    way = way / length
    palm = wrist + _PALM * forearm_m * way
    place = camera.pixels_of(palm)
    distance_m = _distance(depth_mm, place, palm[2], forearm_m, max(palm[2], 0.2) / camera.fx)
    if distance_m is None:
        return None
    forearm_px = forearm_m * camera.fx / distance_m
    flat = float(np.hypot(way[0], way[1]))
    axis = way[:2] / flat if flat > 0.2 else np.array([0.0, -1.0])
    side = np.array([-axis[1], axis[0]]) * (-1.0 if mirrored else 1.0)
    grid = place + forearm_px * (_PLACES[:, None, None] * axis + _PLACES[None, :, None] * side)
    filled, nearer_m, missing = sampled(depth_mm, grid, distance_m, _BAND * forearm_m)
    core = filled[_CORE]
    if core.sum() > _LEAST_CORE:  # the hand may lie beside its tracked place
        shift = np.clip((core @ _PLACES).sum() / core.sum(), -_MOST_ASIDE, _MOST_ASIDE)
        grid = grid + forearm_px * shift * side
        filled, nearer_m, missing = sampled(depth_mm, grid, distance_m, _BAND * forearm_m)
    nearer = nearer_m / forearm_m
    behind = (distance_m - palm[2]) / forearm_m
    along = np.clip(_PLACES[:, None] * flat + (behind - nearer) * way[2], -_MOST_ALONG, _MOST_ALONG)
    samples = np.stack([filled, nearer / _BAND * filled, missing, along * filled], axis=-1)
    ray = palm / np.linalg.norm(palm)
    about = np.array([way @ ray, forearm_px / 30.0 - 1.0, distance_m / 3.0 - 0.8, behind])
    return HandWindow(samples.astype(np.float32), about.astype(np.float32))


def _distance(
    depth_mm: NDArray[np.uint16], place: Array, z: float, forearm_m: float, pixel_m: float
) -> float | None:
    """Return the distance of the nearest surface about the palm's place [m]; None where there is none."""
    radius = max(_ABOUT_PALM * forearm_m / pixel_m, 1.5)
    low = np.floor(place - radius).astype(int)
    high = np.ceil(place + radius).astype(int) + 1
    rows = slice(max(low[1], 0), max(high[1], 0))
    patch = depth_mm[rows, max(low[0], 0) : max(high[0], 0)].ravel() * 1e-3
    patch = patch[(patch > 0) & (np.abs(patch - z) < _SEARCHED * forearm_m)]
    if len(patch) < _LEAST_SEEN:
        return None
    distance_m = min(z, float(np.percentile(patch, _NEAREST_PERCENT)))
    for _ in range(4):  # mean shift to the middle of a band as thick as a hand
        near = patch[np.abs(patch - distance_m) < _THICK * forearm_m]
        if not len(near):
            return float(np.median(patch))
        distance_m = float(near.mean())
    return distance_m
