"""Usual error of a camera's joints by distance, direction, joint and confidence.

Axial noise of depth cameras grows with the square of the distance, lateral noise with the distance: Nguyen,
Izadi, Lovell, "Modeling Kinect sensor noise for improved 3D reconstruction and tracking", 3DIMPVT 2012.
Joints at the ends of limbs are less accurate than those of the trunk: Otte et al., "Accuracy and
reliability of the Kinect version 2 for clinical measurement of motor function", PLoS ONE 2016.
"""

import numpy as np
from numpy.typing import NDArray

from studio.engine.base.compiled import compiled
from studio.engine.model.joints import CANONICAL

AXIAL_PER_M = 0.0016
LATERAL_PER_M = 0.0032
LEAST_DISTANCE_M = 0.1
_FACTOR = {"elbow": 1.0, "knee": 1.0, "wrist": 1.5, "ankle": 1.5, "hand": 2.0, "toe": 2.0}
JOINT_FACTOR: NDArray[np.float64] = np.array([_FACTOR.get(name.split("_")[-1], 0.75) for name in CANONICAL])
"""Noise of each canonical joint of a depth camera relative to an elbow's."""

LANDMARK_M = 0.011
"""Usual error of a landmark across the line of sight: some 1 % of a body, as found by BlazePose's authors and users.
A pose network sees the body's part of the picture in one size, so its errors do not grow with the distance.
"""

_LANDMARK_FACTOR = {"hips": 4.0, "hip": 1.25, "toe": 1.5, "neck": 0.75}
LANDMARK_FACTOR: NDArray[np.float64] = np.array(
    [_LANDMARK_FACTOR.get(name.split("_")[-1], 1.0) for name in CANONICAL]
)
"""Error of each canonical joint in pictures relative to an elbow's, from the distances at which the rays of four real
cameras miss each other. Wrists and ankles have no larger error than elbows; toes, and hip joints, which no picture
shows, have a larger one. Hips are placed on a straight line between hip joints and shoulders, from which a bent trunk
deviates by centimetres.
"""


def covariances(
    positions: NDArray[np.float64], confidence: NDArray[np.float64], camera_positions: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return each joint's covariance [m2], shape (camera_count, 21, 3, 3), in the stage frame.

    Args:
        positions: joints per camera in the stage frame [m], shape (camera_count, 21, 3); NaN = unseen.
        confidence: shape (camera_count, 21). Half the confidence is about twice the deviation.
        camera_positions: optical centres [m], shape (camera_count, 3).
    """
    return _along_and_across(*variances(positions, confidence, camera_positions))


def informations(
    positions: NDArray[np.float64],
    confidence: NDArray[np.float64],
    camera_positions: NDArray[np.float64],
    along_m: NDArray[np.float64] | None = None,
) -> NDArray[np.float64]:
    """Return the inverses of `covariances` [1/m2]; `along_m` as for `variances`."""
    ray, axial, lateral = variances(positions, confidence, camera_positions, along_m)
    return _along_and_across(ray, 1.0 / axial, 1.0 / lateral)


def variances(
    positions: NDArray[np.float64],
    confidence: NDArray[np.float64],
    camera_positions: NDArray[np.float64],
    along_m: NDArray[np.float64] | None = None,
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Return the rays' directions, shape (..., camera_count, 21, 3), and the variances along and across them [m2].

    Args:
        positions, confidence, camera_positions: as for `covariances`; a leading axis stands for many instants.
        along_m: standard deviation along the rays of cameras that see no depth [m], shape (camera_count,); NaN = of
            the others.
    """
    ray, axial, lateral = _variances(
        positions.reshape(-1, *positions.shape[-2:]),
        np.ascontiguousarray(confidence).reshape(-1, confidence.shape[-1]),
        camera_positions,
        JOINT_FACTOR,
    )
    axial, lateral = axial.reshape(confidence.shape), lateral.reshape(confidence.shape)
    if along_m is not None:
        depthless = ~np.isnan(along_m)
        axial[..., depthless, :] = along_m[depthless, None] ** 2
        away = positions[..., depthless, :, :] - camera_positions[depthless, None]
        distance = np.maximum(np.linalg.norm(away, axis=-1), LEAST_DISTANCE_M)
        share = LANDMARK_FACTOR / JOINT_FACTOR * LANDMARK_M / (LATERAL_PER_M * distance)
        lateral[..., depthless, :] *= share**2
    return ray.reshape(positions.shape), axial, lateral


@compiled
def _variances(
    positions: NDArray[np.float64],
    confidence: NDArray[np.float64],
    cameras: NDArray[np.float64],
    factor: NDArray[np.float64],
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """`variances` of skeletons, shape (count, 21, 3), of the cameras in turn; `factor` of each joint, shape (21,)."""
    ray, axial, lateral = np.empty(positions.shape), np.empty(confidence.shape), np.empty(confidence.shape)
    for n in range(len(positions)):
        camera = cameras[n % len(cameras)]
        for k in range(positions.shape[1]):
            squared = 0.0
            for a in range(3):
                ray[n, k, a] = positions[n, k, a] - camera[a]
                squared += ray[n, k, a] * ray[n, k, a]
            distance = np.maximum(np.sqrt(squared), LEAST_DISTANCE_M)
            for a in range(3):
                ray[n, k, a] /= distance
            doubt = factor[k] * min(max(1.0 + 5.0 * (0.85 - confidence[n, k]), 1.0), 4.5)
            axial[n, k] = (AXIAL_PER_M * distance * distance * doubt) ** 2
            lateral[n, k] = (LATERAL_PER_M * distance * doubt) ** 2
    return ray, axial, lateral


@compiled
def _along_and_across(
    ray: NDArray[np.float64], axial: NDArray[np.float64], lateral: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Matrices, shape (camera_count, 21, 3, 3), with variance `axial` along the rays and `lateral` across them."""
    out = np.empty((*axial.shape, 3, 3))
    for c in range(axial.shape[0]):
        for k in range(axial.shape[1]):
            for a in range(3):
                for b in range(3):
                    out[c, k, a, b] = (axial[c, k] - lateral[c, k]) * ray[c, k, a] * ray[c, k, b]
                out[c, k, a, a] += lateral[c, k]
    return out
