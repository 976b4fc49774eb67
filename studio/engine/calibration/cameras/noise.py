"""Standard deviation of a camera's joint along its ray and across it, by joint and by confidence.

Depth cameras measure distance with an error that grows with its square (Khoshelham and Elberink, "Accuracy and
resolution of Kinect depth data", Sensors 2012, eq. 10); across the ray the error is that of finding the joint.
Hands and feet are small and fast, the trunk is large.
"""

import numpy as np
from numpy.typing import NDArray

from studio.engine.model.cameras.joint_noise import JOINT_FACTOR

ALONG_PER_M2 = 0.0016
ACROSS_M = 0.01
_UNSURE_FACTOR = 4.0
_DIAGONAL = np.arange(3)


def rays(positions: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return unit vectors from the camera to each joint, shape (..., 3), of joints in the camera frame."""
    return positions / np.maximum(np.linalg.norm(positions, axis=-1, keepdims=True), 1e-6)


def unbiased(positions: NDArray[np.float64], depth_bias_m: float) -> NDArray[np.float64]:
    """Return joints in the camera frame with the depth bias removed: moved away from the camera along their rays."""
    return positions + depth_bias_m * rays(positions)


def sigmas(
    positions: NDArray[np.float64], confidence: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return standard deviations [m] along and across the ray, each of shape (..., 21).

    Args:
        positions: camera frame [m], shape (..., 21, 3); NaN gives NaN.
        confidence: shape (..., 21); from 0.8 a joint counts as sure, under 0.5 as four times less sure.
    """
    unsure = np.clip((0.8 - confidence) / 0.3, 0.0, 1.0)
    factor = JOINT_FACTOR * (1.0 + (_UNSURE_FACTOR - 1.0) * unsure)
    seen = np.isfinite(positions[..., 2])
    # The whole body's depth. With its own depth, a joint that noise brings nearer would weigh more and bias the fit.
    depth = np.where(seen, positions[..., 2], 0.0).sum(axis=-1) / np.maximum(seen.sum(axis=-1), 1)
    along = np.maximum(ALONG_PER_M2 * depth[..., None] ** 2, 0.005) * factor
    return np.where(seen, along, np.nan), np.where(seen, ACROSS_M * factor, np.nan)


def covariances(
    positions: NDArray[np.float64], confidence: NDArray[np.float64], rotation: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return the joints' covariances [m^2] rotated by `rotation`, shape (..., 21, 3, 3)."""
    along, across = sigmas(positions, confidence)
    direction = rays(positions) @ rotation.T
    added = (along**2 - across**2)[..., None] * direction
    out = added[..., :, None] * direction[..., None, :]
    out[..., _DIAGONAL, _DIAGONAL] += (across**2)[..., None]
    return out
