"""Every camera's joints at the output times, with what each tells: the input of finishing."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from studio.engine.frames import FrameSet
from studio.engine.fusion.noise import covariances
from studio.engine.joints import MIRROR

SWAP_SHARE = 0.7
"""A camera's left and right are turned round where that brings its joints this much nearer to the first solve."""


@dataclass(frozen=True)
class Measurements:
    """Joints of all cameras over a take.

    Attributes:
        positions: shape (frame_count, camera_count, 21, 3), stage frame [m]; 0 where unseen.
        information: inverse covariance [1/m2], shape (frame_count, camera_count, 21, 3, 3); 0 where unseen.
    """

    positions: NDArray[np.float64]
    information: NDArray[np.float64]

    def part(self, rows: slice) -> "Measurements":
        """The measurements of some frames."""
        return Measurements(self.positions[rows], self.information[rows])


def _swapped(positions: NDArray[np.float64], expected: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Which cameras see left for right in which frames, shape (frame_count, camera_count)."""

    def cost(joints: NDArray[np.float64]) -> NDArray[np.float64]:
        distance = np.minimum(np.linalg.norm(joints - expected[:, None], axis=3), 0.3)
        distance = np.where((MIRROR != np.arange(len(MIRROR))) & ~np.isnan(distance), distance, np.nan)
        count = (~np.isnan(distance)).sum(axis=2)
        return np.nansum(distance, axis=2) / np.maximum(count, 1)

    as_is, mirrored = cost(positions), cost(positions[:, :, MIRROR])
    return (mirrored < SWAP_SHARE * as_is) & (as_is > 0.06)


def gather(frames: list[FrameSet], expected: NDArray[np.float64]) -> Measurements:
    """Return the measurements of a take.

    Args:
        frames: one frame set per output frame.
        expected: the first solve's canonical joints [m], shape (frame_count, 21, 3).
    """
    positions = np.array([f.positions for f in frames])
    confidence = np.array([f.confidence for f in frames])
    swapped = _swapped(positions, expected)
    positions[swapped] = positions[swapped][:, MIRROR]
    confidence[swapped] = confidence[swapped][:, MIRROR]
    seen = ~np.isnan(positions[..., 0])
    positions = np.where(seen[..., None], positions, 0.0)
    information = np.zeros((*positions.shape, 3))
    for k in range(len(frames)):  # per frame, to keep memory small
        noise = covariances(positions[k], confidence[k], frames[k].camera_positions)
        information[k] = np.linalg.inv(noise) * seen[k][..., None, None]
    return Measurements(positions, information)
