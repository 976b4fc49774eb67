"""The cameras of an adjustment, their projection of points, and its derivatives by each unknown."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from studio.engine.calibration.views.seen.bodies import Array
from studio.engine.model.calibration import CameraCalibration
from studio.engine.model.triangulation.triangulation import triangulate

TURN, SHIFT, FOCAL, BEND, AHEAD, CENTRE = slice(0, 3), slice(3, 6), 6, 7, 8, slice(9, 11)
"""Columns of a camera's unknowns: rotation vector, translation, logarithm of the focal length, distortion, clock,
principal point."""
UNKNOWNS = 11
_LEAST_DEPTH_M = 0.2
_CAUCHY, _ROUNDS = 3.0, 4
"""Settings of `triangulate`: cameras are not placed yet, so errors are larger, and places need not be final."""


@dataclass(frozen=True)
class CameraRig:
    """Cameras during an adjustment. Points are in the frame of the first camera [m].

    Attributes:
        turns: rotation from that frame to each camera, shape (camera_count, 3, 3).
        shifts: translation of the same transform [m], shape (camera_count, 3).
        focals: [pixel], shape (camera_count,).
        bends: coefficient of the radial distortion, shape (camera_count,).
        ahead_s: what is added to a camera's stamps to give the common clock [s], shape (camera_count,).
        centres: principal points from the picture's middle [pixel], shape (camera_count, 2).
    """

    turns: Array
    shifts: Array
    focals: Array
    bends: Array
    ahead_s: Array
    centres: Array

    def seen_from(self, positions: Array) -> Array:
        """Return points, shape (..., 3), in each camera's frame [m], shape (camera_count, ..., 3)."""
        moved = np.einsum("cab,...b->c...a", self.turns, positions)
        return moved + self.shifts.reshape(len(self.shifts), *(1,) * (positions.ndim - 1), 3)

    def show(self, positions: Array) -> tuple[Array, NDArray[np.bool_]]:
        """Return pixels from the picture's middle, shape (camera_count, ..., 2), and whether points are in front."""
        p = self.seen_from(positions)
        front = p[..., 2] > _LEAST_DEPTH_M
        rays = p[..., :2] / np.where(front, p[..., 2], 1.0)[..., None]
        return rays * self._scale(rays) + self.centres.reshape(-1, *(1,) * (rays.ndim - 2), 2), front

    def _scale(self, rays: Array) -> Array:
        ones = (1,) * (rays.ndim - 1)
        radius = (rays**2).sum(axis=-1, keepdims=True)
        return self.focals.reshape(-1, *ones) * (1.0 + self.bends.reshape(-1, *ones) * radius)

    def rays_of(self, camera: int, points: Array) -> Array:
        """Return x/z and y/z of pixels from a picture's middle, shape (..., 2)."""
        target = (points - self.centres[camera]) / self.focals[camera]
        rays = target.copy()
        for _ in range(8):
            rays = target / np.maximum(1.0 + self.bends[camera] * (rays**2).sum(axis=-1, keepdims=True), 0.2)
        return rays

    def meeting(self, points: Array, weight: Array) -> Array:
        """Return where the rays of pixels meet [m], shape (..., 3); NaN where fewer than two cameras see one.

        Args:
            points: pixels from the pictures' middles, shape (camera_count, ..., 2).
            weight: inverse squared errors [1/pixel^2], shape (camera_count, ...); 0 = unseen.
        """
        return self.meeting_of(self.ends_of(points), weight)

    def ends_of(self, points: Array) -> Array:
        """Return a point on the ray of each pixel [m], shape (camera_count, ..., 3); `points` as in `meeting`."""
        count = len(self.focals)
        rays = np.stack([self.rays_of(c, points[c].reshape(-1, 2)) for c in range(count)])
        ways = np.concatenate([rays, np.ones((*rays.shape[:-1], 1))], axis=-1)
        ends = self.optical_centres[:, None] + np.einsum("cba,cnb->cna", self.turns, ways)
        return ends.reshape(*points.shape[:-1], 3)

    def meeting_of(self, ends: Array, weight: Array) -> Array:
        """Return the same as `meeting`, of rays through points [m], shape (camera_count, ..., 3)."""
        count, shape = len(self.focals), weight.shape[1:]
        weight = weight.reshape(count, -1)
        errors = 1.0 / (self.focals[:, None] * np.sqrt(np.where(weight > 0, weight, 1.0)))
        ends = np.where(weight[..., None] > 0, ends.reshape(count, -1, 3), np.nan)
        places = triangulate(
            ends, errors, self.optical_centres, np.ones(count, dtype=np.bool_), cauchy=_CAUCHY, rounds=_ROUNDS
        )
        return places.reshape(*shape, 3)

    @property
    def optical_centres(self) -> Array:
        """The cameras' optical centres [m], shape (camera_count, 3)."""
        return -np.einsum("cba,cb->ca", self.turns, self.shifts)

    def changes(self, camera: int, positions: Array, speed: Array) -> tuple[Array, Array, Array]:
        """Return a camera's pixels, shape (..., 2), and their derivatives.

        Args:
            positions: [m], shape (..., 3).
            speed: of the observed pixels [pixel/s], shape (..., 2).

        Returns:
            Pixels; derivatives by the point, shape (..., 2, 3), and by the camera's unknowns, shape (..., 2, 11); 0
            for points behind the camera.
        """
        turn, focal, bend = self.turns[camera], self.focals[camera], self.bends[camera]
        turned = positions @ turn.T
        p = turned + self.shifts[camera]
        front = p[..., 2] > _LEAST_DEPTH_M
        z = np.where(front, p[..., 2], 1.0)
        x, y = p[..., 0] / z, p[..., 1] / z
        radius = x * x + y * y
        scale = 1.0 + bend * radius
        a, b, d = (
            focal * (scale + 2 * bend * x * x),
            focal * 2 * bend * x * y,
            focal * (scale + 2 * bend * y * y),
        )
        across = np.stack([a / z, b / z, -(a * x + b * y) / z], -1)
        down = np.stack([b / z, d / z, -(b * x + d * y) / z], -1)
        by_place = np.stack([across, down], -2)
        by_camera = np.zeros((*x.shape, 2, UNKNOWNS))
        by_camera[..., TURN] = np.cross(turned[..., None, :], by_place)
        by_camera[..., SHIFT] = by_place
        pixels = np.stack([x, y], -1) * (focal * scale)[..., None]
        by_camera[..., FOCAL] = pixels
        by_camera[..., BEND] = np.stack([x, y], -1) * (focal * radius)[..., None]
        by_camera[..., AHEAD] = speed
        by_camera[..., CENTRE] = np.eye(2)
        hide = ~front
        by_camera[hide] = 0.0
        by_place[hide] = 0.0
        return pixels + self.centres[camera], by_place @ turn, by_camera

    def changed(self, steps: Array) -> "CameraRig":
        """Return the rig after steps of its unknowns, shape (camera_count, 11)."""
        from scipy.spatial.transform import Rotation

        turns = Rotation.from_rotvec(steps[:, TURN]).as_matrix()
        return CameraRig(
            turns @ self.turns,
            self.shifts + steps[:, SHIFT],
            self.focals * np.exp(np.clip(steps[:, FOCAL], -0.5, 0.5)),
            self.bends + steps[:, BEND],
            self.ahead_s + steps[:, AHEAD],
            self.centres + steps[:, CENTRE],
        )


def rig_of(cameras: Sequence[CameraCalibration], focals: Sequence[float]) -> CameraRig:
    """Return calibrated cameras as a rig in the stage frame, for undistorted pixels of these focal lengths."""
    turns = np.array([camera.T_stage_camera[:3, :3].T for camera in cameras])
    places = np.array([camera.T_stage_camera[:3, 3] for camera in cameras])
    count = len(cameras)
    shifts = -np.einsum("cab,cb->ca", turns, places)
    return CameraRig(turns, shifts, np.array(focals), np.zeros(count), np.zeros(count), np.zeros((count, 2)))
