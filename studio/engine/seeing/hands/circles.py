"""Open hand or fist by concentric circles, the method of the reference system.

Circles grow from the middle of the hand in the depth image, up to the largest whose points all lie at the hand's
depth. In the next circle, many points at that depth mean an open hand (fingers), few a fist, and anything between
leaves the state unknown. The text gives no thresholds; those here are the best of 24 sets on the simulator's tuning
hands.

Source: Ménard 2014, section 5.4.
"""

import numpy as np
from numpy.typing import NDArray

from studio.engine.model.cameras.depth import DepthCamera

OPEN, CLOSED, UNKNOWN = 0.85, 0.15, 0.5
"""Probabilities of being open for the three outcomes."""

_STEP_M = 0.028
_CIRCLES = 6
_POINTS = 36
_AT_DEPTH_M = 0.09
_FULL = 0.85
_OPEN_SHARE, _CLOSED_SHARE = 0.55, 0.55
_ANGLES = np.linspace(0.0, 2.0 * np.pi, _POINTS, endpoint=False)


def circles_state(camera: DepthCamera, depth_mm: NDArray[np.uint16], hand: NDArray[np.float64]) -> float:
    """Return the probability that a hand is open: `OPEN`, `CLOSED` or `UNKNOWN`.

    Args:
        camera: of the image.
        depth_mm: the image, shape (H, W).
        hand: the middle of the hand in the camera frame [m], shape (3,).
    """
    if not np.isfinite(hand).all() or hand[2] < 0.2:
        return UNKNOWN
    column, row = np.rint(camera.pixels_of(hand)).astype(int)
    if not (0 <= column < depth_mm.shape[1] and 0 <= row < depth_mm.shape[0]):
        return UNKNOWN
    depth_m = depth_mm[row, column] * 1e-3
    if abs(depth_m - hand[2]) > 2 * _AT_DEPTH_M:
        return UNKNOWN
    radii = _STEP_M * np.arange(1, _CIRCLES + 1) * camera.fx / depth_m
    columns = np.rint(column + radii[:, None] * np.cos(_ANGLES)).astype(int)
    rows = np.rint(row + radii[:, None] * np.sin(_ANGLES)).astype(int)
    inside = (columns >= 0) & (columns < depth_mm.shape[1]) & (rows >= 0) & (rows < depth_mm.shape[0])
    around = depth_mm[np.where(inside, rows, row), np.where(inside, columns, column)] * 1e-3
    share = (inside & (np.abs(around - depth_m) < _AT_DEPTH_M)).mean(axis=1)
    full = np.flatnonzero(share >= _FULL)
    following = 0 if not len(full) else int(full[-1]) + 1
    if following >= _CIRCLES:
        return UNKNOWN
    if share[following] >= _OPEN_SHARE:
        return OPEN
    return CLOSED if 1 - share[following] >= _CLOSED_SHARE else UNKNOWN
