"""Which ankles and toes stand on the floor, and when: found in a first smooth pass over the take."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import binary_closing, binary_opening, gaussian_filter1d

from studio.engine.joints import INDEX

JOINTS = tuple(INDEX[name] for name in ("left_ankle", "left_toe", "right_ankle", "right_toe"))

STAND_SPEED_M_S = 0.3
STAND_HEIGHT_M = 0.06
"""A joint stands below this speed and at most this far above the height at which it stands."""

SMOOTHING_S = 0.05
"""Speeds are those of the path smoothed by a Gaussian of this deviation: noise alone moves a standing foot."""

MIN_STAND_S = 0.10
MAX_GAP_S = 0.08


@dataclass(frozen=True)
class Contacts:
    """Standing joints over a take.

    Attributes:
        joints: indices of the canonical joints, one per column.
        standing: shape (frame_count, 4).
        height_m: height at which each stands [m], shape (4,).
    """

    joints: tuple[int, ...]
    standing: NDArray[np.bool_]
    height_m: NDArray[np.float64]

    def part(self, rows: slice) -> "Contacts":
        """The contacts of some frames."""
        return Contacts(self.joints, self.standing[rows], self.height_m)


def find_contacts(feet: NDArray[np.float64], pieces: list[tuple[int, int]], dt: float) -> Contacts:
    """Return who stands when.

    Args:
        feet: `JOINTS` of a smooth trajectory [m], shape (frame_count, 4, 3).
        pieces: begin and end of each part of the take without a gap [frames].
        dt: time between frames [s].
    """
    slow = np.concatenate([_speed(feet[begin:end], dt) < STAND_SPEED_M_S for begin, end in pieces])
    height = np.array([_standing_height(feet[slow[:, k], k, 2]) for k in range(len(JOINTS))])
    standing = slow & (np.abs(feet[:, :, 2] - height) < STAND_HEIGHT_M)
    gap, least = (np.ones((max(1, round(s / dt)), 1), dtype=bool) for s in (MAX_GAP_S, MIN_STAND_S))
    for begin, end in pieces:
        standing[begin:end] = binary_opening(binary_closing(standing[begin:end], gap), least)
    return Contacts(JOINTS, standing, height)


def _speed(feet: NDArray[np.float64], dt: float) -> NDArray[np.float64]:
    """Speed of the smoothed paths [m/s], shape (frame_count, 4)."""
    if len(feet) < 2:
        return np.zeros(feet.shape[:2])
    smooth = gaussian_filter1d(feet, SMOOTHING_S / dt, axis=0, mode="nearest")
    return np.linalg.norm(np.gradient(smooth, dt, axis=0), axis=2)


def _standing_height(heights: NDArray[np.float64]) -> float:
    """The height at which a slow joint is found, of the lower half of its heights; infinite where it never is."""
    if len(heights) == 0:
        return float("inf")
    low = np.sort(heights)[: max(1, len(heights) // 2)]
    return float(np.median(low))
