"""Detects a camera that was moved while the performer walked, by comparing its joints with the other cameras'.

A camera that is bumped, or that follows another person for a while, shifts all its joints alike. The median shift of
a block of time shows it, however short the time before or after; a fit over the whole walk hides it.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

MOVED_M = 0.04
"""Shift of a moved camera. Real Kinects 90 degrees apart shift by up to 3.6 cm in 5 s, with the visible side of the
performer.
"""

_MIN_JOINTS = 200


@dataclass(frozen=True)
class CameraShift:
    """The largest shift of a camera's joints from the other cameras' within a block [m], and when [s]."""

    metres: float
    at_s: float


def largest_shifts(
    positions: NDArray[np.float64], times_s: NDArray[np.float64], block_s: float
) -> list[CameraShift]:
    """Return every camera's largest shift against the other cameras; 0 without a comparison.

    Of three or more cameras the one that moved is identified: it is left out before the others are compared. Two
    cameras have the same shift.

    Args:
        positions: joints by camera in one frame, left and right corrected [m], shape (camera_count, instant_count,
            21, 3); NaN = unseen.
        times_s: shape (instant_count,), increasing.
        block_s: length of a block [s].
    """
    largest = [CameraShift(0.0, float(times_s[0]) if len(times_s) else 0.0) for _ in positions]
    blocks = np.floor(times_s / block_s).astype(int)
    for block in np.unique(blocks):
        inside = blocks == block
        for camera, metres in block_shifts(positions[:, inside], MOVED_M).items():
            if metres > largest[camera].metres:
                largest[camera] = CameraShift(metres, float(times_s[inside][0]))
    return largest


def block_shifts(positions: NDArray[np.float64], moved_m: float) -> dict[int, float]:
    """Return each camera's median shift [m] over some instants, compared without cameras that moved.

    Args:
        positions: as for `largest_shifts`.
        moved_m: a camera with a larger shift has moved.
    """
    cameras = list(range(len(positions)))
    moved: dict[int, float] = {}
    while True:
        shifts = {camera: _shift(positions, camera, cameras) for camera in cameras}
        worst = max(shifts, key=lambda camera: shifts[camera])
        if shifts[worst] <= moved_m or len(cameras) <= 2:
            return {**moved, **shifts}
        moved[worst] = shifts[worst]
        cameras.remove(worst)


def _shift(positions: NDArray[np.float64], camera: int, cameras: list[int]) -> float:
    """Return the distance of a camera's joints from the median of the others', as the median over joints and time
    [m]."""
    if len(cameras) < 2:
        return 0.0
    others = joint_median(positions[[other for other in cameras if other != camera]])
    difference = (positions[camera] - others).reshape(-1, 3)
    difference = difference[np.isfinite(difference).all(axis=1)]
    return float(np.linalg.norm(np.median(difference, axis=0))) if len(difference) >= _MIN_JOINTS else 0.0


def joint_median(positions: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the median of the finite values over the first axis; NaN where there is none."""
    ordered = np.sort(positions, axis=0)  # NaN last
    count = np.isfinite(ordered).sum(axis=0)
    last = np.maximum(count - 1, 0)
    middle = [np.take_along_axis(ordered, k[None], axis=0)[0] for k in (last // 2, (last + 1) // 2)]
    return np.where(count > 0, (middle[0] + middle[1]) / 2, np.nan)
