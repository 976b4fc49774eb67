"""Depth images and depth cameras (step 1).

A camera frame has OpenCV's axes: x right, y down, z forward, in metres. A depth image holds z, not the length of the
ray, in millimetres; 0 = no reading.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from studio.engine.model.cameras.lens import Lens

_NEAR_MM, _FAR_MM = 500, 5000


@dataclass(frozen=True)
class DepthCamera(Lens):
    """A depth camera's lens."""

    @cached_property
    def rays(self) -> NDArray[np.float32]:
        """x/z and y/z of every pixel's ray, undistorted, shape (height, width, 2); 0 where no ray reaches the
        pixel."""
        columns, rows = np.meshgrid(
            np.arange(self.width, dtype=np.float64), np.arange(self.height, dtype=np.float64)
        )
        return np.nan_to_num(self.rays_of(np.stack([columns, rows], axis=2)), nan=0.0).astype(np.float32)


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
