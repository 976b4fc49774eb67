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


def find_contacts(sites: NDArray[np.float64], dt: float) -> Contacts:
    """Return who stands when.

    Args:
        sites: canonical joints of a smooth trajectory [m], shape (frame_count, 21, 3).
        dt: time between frames [s].
    """
    feet = sites[:, list(JOINTS)]
    smooth = gaussian_filter1d(feet, SMOOTHING_S / dt, axis=0, mode="nearest")
    velocity = np.gradient(smooth, dt, axis=0) if len(feet) > 1 else np.zeros_like(feet)
    slow = np.linalg.norm(velocity, axis=2) < STAND_SPEED_M_S
    height = np.array([_standing_height(feet[slow[:, k], k, 2]) for k in range(len(JOINTS))])
    standing = slow & (np.abs(feet[:, :, 2] - height) < STAND_HEIGHT_M)
    gap, least = (np.ones((max(1, round(s / dt)), 1), dtype=bool) for s in (MAX_GAP_S, MIN_STAND_S))
    standing = binary_opening(binary_closing(standing, gap), least)
    return Contacts(JOINTS, standing, height)


def _standing_height(heights: NDArray[np.float64]) -> float:
    """The height at which a slow joint is found, of the lower half of its heights; infinite where it never is."""
    if len(heights) == 0:
        return float("inf")
    low = np.sort(heights)[: max(1, len(heights) // 2)]
    return float(np.median(low))
