"""Pinhole cameras with lens distortion: pixels to rays and back.

A camera frame has OpenCV's axes: x right, y down, z forward, in metres. The centre of the first pixel is (0, 0).
The distortion is that of Brown and Conrady ("Decentering distortion of lenses", Photogrammetric Engineering 32, 1966)
with the rational radial part that OpenCV uses.
"""

from dataclasses import dataclass, replace
from typing import Self

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

USUAL_FIELD_DEG = 65.0
"""Common webcams and phones have 55 to 78 degrees."""

_WIDEST = 3.0
_REACHED_PX = 0.5
_ROUNDS = 20
_SAME_SHAPE = 0.01


@dataclass(frozen=True)
class Lens:
    """Intrinsics of a camera.

    Attributes:
        fx, fy, cx, cy: focal lengths and principal point [pixels].
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

    def rays_of(self, pixels: NDArray[np.floating]) -> Array:
        """Return x/z and y/z of the rays of pixels (column, row), undistorted, shape (..., 2) -> (..., 2).

        NaN where no ray reaches the pixel: at the corners of a wide lens's image the distortion has no inverse.
        """
        target = (np.asarray(pixels, np.float64) - [self.cx, self.cy]) / [self.fx, self.fy]
        if not self.distortion:
            return target
        rays = before = known = np.where(np.isnan(target), 0.0, target)
        for left in reversed(range(_ROUNDS)):  # fixed-point iteration: distortion is a small correction
            factor, shift = _distortion(rays, self.distortion)
            last, before = before, rays
            rays = np.clip((known - shift) / factor[..., None], -_WIDEST, _WIDEST)
            if left % 2 == 0 and (rays == last).all():
                break  # converged, or alternating by a last digit: two more rounds change nothing
        factor, shift = _distortion(rays, self.distortion)
        reached = np.abs(rays * factor[..., None] + shift - target).max(axis=-1) * self.fx < _REACHED_PX
        return np.where(reached[..., None], rays, np.nan)

    def pixels_of(self, points: NDArray[np.floating]) -> Array:
        """Return the pixels (column, row) of points in the camera frame [m], shape (..., 3) -> (..., 2).

        Points must lie in front of the camera.
        """
        rays = np.asarray(points[..., :2] / points[..., 2:], dtype=np.float64)
        if self.distortion:
            factor, shift = _distortion(rays, self.distortion)
            rays = rays * factor[..., None] + shift
        return rays * [self.fx, self.fy] + [self.cx, self.cy]

    def sized(self, width: int, height: int) -> Self | None:
        """Return this lens for images of another size [pixels]; None if their shape differs.

        A picture of another shape was cropped or turned in an unknown way.
        """
        if (width, height) == (self.width, self.height):
            return self
        by = width / self.width
        if abs(height / (by * self.height) - 1.0) > _SAME_SHAPE:
            return None
        return replace(
            self,
            fx=self.fx * by,
            fy=self.fy * by,
            cx=(self.cx + 0.5) * by - 0.5,
            cy=(self.cy + 0.5) * by - 0.5,
            width=width,
            height=height,
        )


def usual_lens(width: int, height: int) -> Lens:
    """Return the lens that webcams and phones usually have: `USUAL_FIELD_DEG` across the longer side."""
    focal = 0.5 * max(width, height) / np.tan(np.radians(0.5 * USUAL_FIELD_DEG))
    return Lens(focal, focal, 0.5 * (width - 1), 0.5 * (height - 1), width, height)


def _distortion(rays: Array, coefficients: tuple[float, ...]) -> tuple[Array, Array]:
    """Return the radial factor, shape (...), and the tangential shift, shape (..., 2), at undistorted rays."""
    k1, k2, p1, p2, k3, k4, k5, k6 = (*coefficients, *(0.0,) * (8 - len(coefficients)))
    x, y = rays[..., 0], rays[..., 1]
    r2 = x * x + y * y
    factor = (1 + r2 * (k1 + r2 * (k2 + r2 * k3))) / (1 + r2 * (k4 + r2 * (k5 + r2 * k6)))
    shift = np.empty_like(rays)
    shift[..., 0] = 2 * p1 * x * y + p2 * (r2 + 2 * x * x)
    shift[..., 1] = p1 * (r2 + 2 * y * y) + 2 * p2 * x * y
    return factor, shift
