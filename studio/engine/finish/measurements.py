"""Every camera's joints at the output times, with what each tells: the input of finishing."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from studio.engine.fusion.noise import variances
from studio.engine.joints import JOINT_COUNT, MIRROR

SWAP_SHARE = 0.7
"""A camera's left and right are turned round where that brings its joints this much nearer to the first solve."""

ALIKE = 0.4
"""Variance of the step of a noise from frame to frame relative to its own: 2 (1 - 0.8) for depth cameras at 30 Hz."""

CHI2_3_MEDIAN = 2.366
LEAST_COUNT = 60
SHARE = 2.0
SCALE_RANGE = (1.0, 30.0)
"""A noise is found from this many frames, and within this range of what is usual, as variance; one that differs from
frame to frame counts more, since it moves the body more."""


@dataclass(frozen=True)
class Measurements:
    """Joints of all cameras over some frames; a camera's covariance is `axial` along its ray, `lateral` across.

    Attributes:
        positions: shape (frame_count, camera_count, 21, 3), stage frame [m]; 0 where unseen.
        rays: unit vectors from the camera to the joint, same shape.
        axial: inverse variance along the ray [1/m2], shape (frame_count, camera_count, 21); 0 where unseen.
        lateral: the same across it.
    """

    positions: NDArray[np.float64]
    rays: NDArray[np.float64]
    axial: NDArray[np.float64]
    lateral: NDArray[np.float64]

    def squared(self, difference: NDArray[np.float64]) -> NDArray[np.float64]:
        """Squares of differences, shape (frame_count, camera_count, 21, 3), in deviations; shape without the 3."""
        along = np.einsum("tcja,tcja->tcj", difference, self.rays)
        return self.lateral * np.einsum("tcja,tcja->tcj", difference, difference) + (
            self.axial - self.lateral
        ) * (along * along)

    def scaled(self, factor: NDArray[np.float64]) -> "Measurements":
        """The same with variances times a factor, shape (camera_count, 21)."""
        return replace(self, axial=self.axial / factor, lateral=self.lateral / factor)


class NoiseScale:
    """How noisy each camera's joints are in this take, against what `fusion.noise` says of them.

    What a camera's joint does from one of its frames to the next, and the smooth body does not, is noise. Of noise
    that is alike from frame to frame little shows so: `ALIKE` says how much. The median tells, since spikes must not.
    """

    def __init__(self, cameras: int) -> None:
        self._edges = np.linspace(-8.0, 12.0, 201)  # of logarithms
        self._counts = np.zeros((cameras, JOINT_COUNT, len(self._edges) - 1))

    def add(self, measurements: Measurements, sites: NDArray[np.float64], lag: int) -> None:
        """Count what cameras see `lag` frames apart.

        Args:
            measurements: of some frames.
            sites: the body's canonical joints in them [m], shape (frame_count, 21, 3).
            lag: output frames in a camera's frame.
        """
        off = measurements.positions - sites[:, None]
        seen = measurements.axial > 0.0
        both = seen[lag:] & seen[:-lag]
        moved = np.zeros_like(off)
        moved[lag:] = off[lag:] - off[:-lag]
        squared = measurements.squared(moved)[lag:]
        bins = np.digitize(np.log(np.maximum(squared, 1e-9)), self._edges[1:-1])
        cameras, joints = np.meshgrid(*map(np.arange, both.shape[1:]), indexing="ij")
        where = (
            np.broadcast_to(cameras, both.shape)[both],
            np.broadcast_to(joints, both.shape)[both],
            bins[both],
        )
        np.add.at(self._counts, where, 1.0)

    def factor(self) -> NDArray[np.float64]:
        """What to multiply variances by, shape (camera_count, 21); 1 where there is little to tell by."""
        total = self._counts.sum(axis=2)
        middle = 0.5 * (self._edges[1:] + self._edges[:-1])
        below = self._counts.cumsum(axis=2) - 0.5 * self._counts
        out = np.ones(total.shape)
        for camera, joint in zip(*np.nonzero(total >= LEAST_COUNT), strict=True):
            median = np.interp(0.5 * total[camera, joint], below[camera, joint], middle)
            out[camera, joint] = np.exp(median) / (CHI2_3_MEDIAN * ALIKE)
        return np.clip(SHARE * out, *SCALE_RANGE)


def swapped(positions: NDArray[np.float64], expected: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Return which cameras see left for right in which frames, shape (frame_count, camera_count).

    Args:
        positions: shape (frame_count, camera_count, 21, 3) [m]; NaN = unseen.
        expected: the first solve's canonical joints [m], shape (frame_count, 21, 3).
    """

    def cost(joints: NDArray[np.float64]) -> NDArray[np.float64]:
        distance = np.minimum(np.linalg.norm(joints - expected[:, None], axis=3), 0.3)
        distance = np.where((MIRROR != np.arange(len(MIRROR))) & ~np.isnan(distance), distance, np.nan)
        count = (~np.isnan(distance)).sum(axis=2)
        return np.nansum(distance, axis=2) / np.maximum(count, 1)

    as_is, mirrored = cost(positions), cost(positions[:, :, MIRROR])
    return (mirrored < SWAP_SHARE * as_is) & (as_is > 0.06)


def measure(
    positions: NDArray[np.float64], confidence: NDArray[np.float64], camera_positions: NDArray[np.float64]
) -> Measurements:
    """Return the measurements of some frames; the noise is that of `fusion.noise`.

    Args:
        positions: shape (frame_count, camera_count, 21, 3), stage frame [m]; NaN = unseen.
        confidence: shape (frame_count, camera_count, 21).
        camera_positions: optical centres [m], shape (camera_count, 3).
    """
    seen = ~np.isnan(positions[..., 0])
    positions = np.where(seen[..., None], positions, 0.0)
    rays, axial, lateral = variances(positions, confidence, camera_positions)
    return Measurements(positions, rays, seen / axial, seen / lateral)
