"""Every camera's joints at the output times, with what each tells: the input of finishing."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from studio.engine.fusion.noise import AXIAL_PER_M, JOINT_FACTOR, LATERAL_PER_M, LEAST_DISTANCE_M
from studio.engine.joints import MIRROR

SWAP_SHARE = 0.7
"""A camera's left and right are turned round where that brings its joints this much nearer to the first solve."""


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
    rays = positions - camera_positions[:, None, :]
    distance = np.maximum(np.sqrt(np.einsum("tcjk,tcjk->tcj", rays, rays)), LEAST_DISTANCE_M)
    rays /= distance[..., None]
    doubt = JOINT_FACTOR * np.clip(1.0 + 5.0 * (0.85 - confidence), 1.0, 4.5)
    axial = seen / (AXIAL_PER_M * distance**2 * doubt) ** 2
    lateral = seen / (LATERAL_PER_M * distance * doubt) ** 2
    return Measurements(positions, rays, axial, lateral)
