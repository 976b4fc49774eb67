"""Depth images and depth cameras (step 1).

A camera frame has OpenCV's axes: x right, y down, z forward, in metres. A depth image holds z, not the length of the
ray, in millimetres; 0 = no reading.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

_WIDEST = 3.0
_REACHED_PX = 0.5
_NEAR_MM, _FAR_MM = 500, 5000


@dataclass(frozen=True)
class DepthCamera:
    """Intrinsics of a depth camera.

    Attributes:
        fx, fy, cx, cy: focal lengths and principal point [pixels]; the centre of the first pixel is (0, 0).
        width, height: image size [pixels].
        distortion: Brown-Conrady coefficients in OpenCV's order, `k1 k2 p1 p2 [k3 [k4 k5 k6]]`; empty = none.
    """

    fx: float
    fy: float
    cx: float
    cy: float
    width: int
    height: int
    distortion: tuple[float, ...] = ()

    @cached_property
    def rays(self) -> NDArray[np.float32]:
        """x/z and y/z of every pixel's ray, undistorted, shape (height, width, 2); 0 where no ray reaches the pixel.

        At the corners of a wide lens's image the distortion has no inverse.
        """
        columns, rows = np.meshgrid(
            np.arange(self.width, dtype=np.float64), np.arange(self.height, dtype=np.float64)
        )
        target = np.stack([(columns - self.cx) / self.fx, (rows - self.cy) / self.fy], axis=2)
        if not self.distortion:
            return target.astype(np.float32)
        rays = target.copy()
        for _ in range(20):  # fixed-point iteration: distortion is a small correction
            factor, shift = _distortion(rays, self.distortion)
            rays = np.clip((target - shift) / factor[..., None], -_WIDEST, _WIDEST)
        factor, shift = _distortion(rays, self.distortion)
        reached = np.abs(rays * factor[..., None] + shift - target).max(axis=2) * self.fx < _REACHED_PX
        return np.where(reached[..., None], rays, 0.0).astype(np.float32)


@dataclass(frozen=True)
class DepthFrame:
    """A depth image of one camera.

    Attributes:
        camera: the camera's name.
        sequence: number of the frame; skeletons of the same camera share the count.
        device_time_ns: capture time on the camera's clock [ns].
        depth_mm: z per pixel [mm], uint16, shape (height, width); 0 = no reading.
    """

    camera: str
    sequence: int
    device_time_ns: int
    depth_mm: NDArray[np.uint16]


def points(camera: DepthCamera, depth_mm: NDArray[np.uint16]) -> NDArray[np.float32]:
    """Return the points of a depth image in the camera frame [m], shape (height, width, 3); 0 where there is no
    reading."""
    z = depth_mm.astype(np.float32) * np.float32(0.001)
    result = np.empty((*z.shape, 3), np.float32)
    np.multiply(camera.rays, z[..., None], out=result[..., :2])
    result[..., 2] = z
    return result


def shade(depth_mm: NDArray[np.uint16]) -> NDArray[np.uint8]:
    """Return a depth image as grey levels, near = bright, 0 = no reading, shape (height, width)."""
    share = (np.clip(depth_mm.astype(np.float32), _NEAR_MM, _FAR_MM) - _NEAR_MM) / (_FAR_MM - _NEAR_MM)
    return np.where(depth_mm > 0, 235 - 195 * share, 0).astype(np.uint8)


def project(camera: DepthCamera, places: NDArray[np.floating]) -> NDArray[np.float64]:
    """Return the pixels (column, row) of points in the camera frame [m], shape (..., 3) -> (..., 2).

    Points must lie in front of the camera.
    """
    rays = np.asarray(places[..., :2] / places[..., 2:], dtype=np.float64)
    if camera.distortion:
        factor, shift = _distortion(rays, camera.distortion)
        rays = rays * factor[..., None] + shift
    return rays * [camera.fx, camera.fy] + [camera.cx, camera.cy]


def _distortion(
    rays: NDArray[np.float64], coefficients: tuple[float, ...]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the radial factor, shape (...), and the tangential shift, shape (..., 2), at undistorted rays."""
    k1, k2, p1, p2, k3, k4, k5, k6 = (*coefficients, *(0.0,) * (8 - len(coefficients)))
    x, y = rays[..., 0], rays[..., 1]
    r2 = x * x + y * y
    factor = (1 + r2 * (k1 + r2 * (k2 + r2 * k3))) / (1 + r2 * (k4 + r2 * (k5 + r2 * k6)))
    shift = np.stack(
        [2 * p1 * x * y + p2 * (r2 + 2 * x * x), p1 * (r2 + 2 * y * y) + 2 * p2 * x * y], axis=-1
    )
    return factor, shift
