"""Joints of cameras that see no depth: each lies on a ray, and all cameras together give its place on it (step 3).

A single camera's joints are guessed from its picture.
"""

from collections.abc import Iterator
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from studio.engine.base.geometry import transform_points
from studio.engine.model.calibration import CameraCalibration
from studio.engine.model.cameras.lens import Lens, usual_lens
from studio.engine.model.frames import PictureJoints
from studio.engine.model.joints import MIRROR
from studio.engine.model.triangulation.guess import NEAREST_M, guessed_joints
from studio.engine.model.triangulation.triangulation import triangulate

Array = NDArray[np.float64]

ACROSS_PER_M = 0.0035
"""Usual error of a landmark across its ray, per metre of distance."""

POINT_M = 0.02
"""Usual error of a depth camera's joint [m]."""

LEAST_ANGLE_RAD = 0.06
"""Smallest angle between rays that give a place."""

SWAP_SHARE, SWAP_M, MOST_M = 0.7, 0.06, 0.3
"""Left and right of cameras are exchanged if that reduces the distance of all rays from the joints' places to this
share, and one camera's distance exceeds the second value; the distance of a joint is clipped to the third.
"""

MOST_TURNED = 2
"""Maximum number of cameras that exchange left and right at once."""

_PAIRED = np.flatnonzero(MIRROR != np.arange(len(MIRROR)))

FREE_M = 10.0
GUESSED_M = 0.15
"""Standard deviation along a ray [m] of a joint of unknown depth, and of a guessed one."""


def on_rays(camera: CameraCalibration, picture: PictureJoints) -> Array:
    """Return points on the rays of a picture's joints, 1 m from the camera, shape (21, 3), stage frame.

    NaN for an unseen joint, and for all joints if the picture has another shape than the camera's lens.
    """
    return _points_on_rays(camera, picture, picture.pixels)


def hands_on_rays(camera: CameraCalibration, picture: PictureJoints) -> Array | None:
    """Return points on the rays of the hands' landmarks as `on_rays` does, shape (2, 21, 3); None = none is seen."""
    if picture.hands is None:
        return None
    return _points_on_rays(camera, picture, picture.hands.reshape(-1, 2)).reshape(2, -1, 3)


def face_on_rays(camera: CameraCalibration, picture: PictureJoints) -> Array | None:
    """Return points on the rays of the face's landmarks as `on_rays` does, shape (11, 3); None = none is seen."""
    return None if picture.face is None else _points_on_rays(camera, picture, picture.face)


def _points_on_rays(camera: CameraCalibration, picture: PictureJoints, pixels: Array) -> Array:
    lens = _lens(camera, picture)
    if lens is None:
        return np.full((len(pixels), 3), np.nan)
    directions = np.column_stack([lens.rays_of(pixels), np.ones(len(pixels))])
    length = np.linalg.norm(directions, axis=1, keepdims=True)
    return transform_points(camera.T_stage_camera, directions / length)


def guessed(camera: CameraCalibration, picture: PictureJoints, confidence: Array, scale: float) -> Array:
    """Return the joints guessed from one picture, shape (21, 3), stage frame; NaN = unknown.

    Args as for `guess.guessed_joints`; a camera whose lens is unknown has a usual one.
    """
    lens = _lens(camera, picture) or usual_lens(picture.width, picture.height)
    return transform_points(camera.T_stage_camera, guessed_joints(picture, confidence, lens, scale))


def _lens(camera: CameraCalibration, picture: PictureJoints) -> Lens | None:
    return None if camera.lens is None else camera.lens.sized(picture.width, picture.height)


def nearest_on_rays(positions: Array, centre: Array, joints: Array) -> Array:
    """Return the points of a camera's rays that are nearest to joints, shape (..., 21, 3) [m].

    Args:
        positions: any points on the rays, shape (..., 21, 3) [m]; NaN = unseen.
        centre: the camera, shape (..., 3) [m].
        joints: shape (..., 21, 3) [m].
    """
    return _nearest(positions, centre, joints)[0]


def _nearest(positions: Array, centre: Array, joints: Array) -> tuple[Array, Array]:
    """`nearest_on_rays`, and the distance of the joint along the ray [m], shape (..., 21)."""
    centre = centre[..., None, :]
    rays = positions - centre
    rays = rays / np.linalg.norm(rays, axis=-1, keepdims=True)
    along = np.vecdot(rays, joints - centre)
    return centre + np.maximum(along, NEAREST_M)[..., None] * rays, along


def placed(
    positions: Array, confidence: Array, centres: Array, rays: NDArray[np.bool_]
) -> tuple[Array, Array]:
    """Return the positions, with those of ray cameras at the places that all cameras give, NaN where they give none;
    and the confidence, 0 there.

    Left and right of a ray camera that confuses them are exchanged.

    Args:
        positions: shape (camera_count, 21, 3) [m]; of a ray camera any points on the rays.
        confidence: shape (camera_count, 21).
        centres: optical centres [m], shape (camera_count, 3).
        rays: the cameras that see no depth, shape (camera_count,).
    """
    sure = np.maximum(confidence, 0.05)
    out, places = _placed(positions, sure, centres, rays)
    missed, exchanged = _mean_missed(positions, centres, places)[rays], list[int]()
    if (missed > SWAP_M).any():
        best = SWAP_SHARE * missed.sum()
        for turned in exchanges(np.flatnonzero(rays)):
            other, other_sure = positions.copy(), sure.copy()
            other[turned], other_sure[turned] = positions[turned][:, MIRROR], sure[turned][:, MIRROR]
            found, places = _placed(other, other_sure, centres, rays)
            total = _mean_missed(other, centres, places)[rays].sum()
            if total < best:
                best, out, exchanged = total, found, turned
    confidence = confidence.copy()
    confidence[exchanged] = confidence[exchanged][:, MIRROR]
    return out, np.where(np.isnan(out[:, :, 0]), 0.0, confidence)


def exchanges(cameras: NDArray[np.int64]) -> Iterator[list[int]]:
    """Yield sets of cameras that may exchange left and right: up to half of them, and `MOST_TURNED`."""
    for count in range(1, min(len(cameras) // 2, MOST_TURNED) + 1):
        yield from (list(chosen) for chosen in combinations(cameras.tolist(), count))


def _mean_missed(positions: Array, centres: Array, places: Array) -> Array:
    """Mean distance at which each camera's rays miss the places of joints with a side [m], shape (camera_count,)."""
    off = nearest_on_rays(positions[:, _PAIRED], centres, places[_PAIRED]) - places[_PAIRED]
    length = np.minimum(np.linalg.norm(off, axis=-1), MOST_M)
    known = ~np.isnan(length)
    return np.where(known, length, 0.0).sum(axis=-1) / np.maximum(known.sum(axis=-1), 1)


def _placed(
    positions: Array, confidence: Array, centres: Array, rays: NDArray[np.bool_]
) -> tuple[Array, Array]:
    """`placed` without exchanges, and the joints' places, shape (21, 3), NaN = unknown."""
    errors = np.where(rays, ACROSS_PER_M, POINT_M)[:, None] / confidence
    places = triangulate(positions, errors, centres, rays, least_angle_rad=LEAST_ANGLE_RAD)
    on_ray, along = _nearest(positions, centres, places)
    on_ray[~(along > NEAREST_M)] = np.nan
    return np.where(rays[:, None, None], on_ray, positions), places
