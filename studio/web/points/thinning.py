"""Thinning of depth images: points of a stage from a part of the pixels, most of them around the performer.

Pixels are taken in the order of a low-discrepancy sequence (Roberts 2018, "R2"): each of its prefixes, also under a
mask, is spread evenly over the image, and the same pixels are taken in every image.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from studio.engine.model.cameras.depth import DepthCamera

CANDIDATES = 65_536
"""Maximum number of pixels of an image that are considered."""

NEAR_SHARE = 2 / 3
"""Share of the points around the performer, if there are enough."""

_STEPS = (0.7548776662466927, 0.5698402909980532)


@dataclass(frozen=True)
class StageSpace:
    """A box in the stage, along its axes: corners `low_m` and `high_m`, shape (3,) [m]."""

    low_m: NDArray[np.float64]
    high_m: NDArray[np.float64]

    @classmethod
    def about(cls, joints_m: NDArray[np.float64], margin_m: float) -> "StageSpace | None":
        """Return the box around the known joints, with a margin; joints (N, 3) [m], NaN = unknown. None: no joint is
        known."""
        known = joints_m[np.isfinite(joints_m).all(axis=1)]
        return cls(known.min(axis=0) - margin_m, known.max(axis=0) + margin_m) if len(known) else None


class Thinner:
    """Makes points from one camera's images; its arrays are reused for every image, so call it from one thread."""

    def __init__(self, camera: DepthCamera) -> None:
        self.camera = camera
        rays = camera.rays.reshape(-1, 2)
        self._order = _order(camera.width, camera.height)
        self._rays = np.ascontiguousarray(rays[self._order].T)
        count = len(self._order)
        self._mm = np.empty(count, dtype=np.uint16)
        self._seen, self._stage = (np.empty((3, count), dtype=np.float32) for _ in range(2))

    def points(
        self,
        depth_mm: NDArray[np.uint16],
        T_stage_camera: NDArray[np.float64],
        count: int,
        near: StageSpace | None,
    ) -> NDArray[np.float32]:
        """Return points of an image in the stage frame [m], shape (N, 3), N at most `count`.

        Args:
            depth_mm: z per pixel [mm], shape (height, width); 0 = no reading.
            T_stage_camera: 4x4, camera points to stage points [m].
            near: the performer's space, which gets `NEAR_SHARE` of the points.

        Raises:
            ValueError: the image has another size than the camera.
        """
        if depth_mm.shape != (self.camera.height, self.camera.width):
            raise ValueError(
                f"an image of shape {depth_mm.shape}; the camera has {self.camera.height, self.camera.width}"
            )
        np.take(depth_mm.reshape(-1), self._order, out=self._mm, mode="clip")
        z = self._seen[2]
        np.multiply(self._mm, np.float32(0.001), out=z)
        np.multiply(self._rays, z, out=self._seen[:2])
        np.matmul(np.ascontiguousarray(T_stage_camera[:3, :3], dtype=np.float32), self._seen, out=self._stage)
        self._stage += T_stage_camera[:3, 3:].astype(np.float32)
        valid = self._mm > 0
        if near is None:
            return self._at(np.flatnonzero(valid)[:count])
        inside = valid.copy()
        for along, low_m, high_m in zip(self._stage, near.low_m, near.high_m, strict=True):
            inside &= (along > low_m) & (along < high_m)
        about, beyond = np.flatnonzero(inside), np.flatnonzero(valid & ~inside)
        about = about[: max(round(NEAR_SHARE * count), count - len(beyond))]
        return self._at(np.concatenate([about, beyond[: count - len(about)]]))

    def _at(self, chosen: NDArray[np.int64]) -> NDArray[np.float32]:
        return np.ascontiguousarray(self._stage[:, chosen].T)


def _order(width: int, height: int) -> NDArray[np.int64]:
    """Return pixels by number in the order in which they are taken, each once, at most `CANDIDATES`."""
    k = np.arange(1, 2 * CANDIDATES + 1, dtype=np.float64)
    columns, rows = (((0.5 + k * step) % 1.0) for step in _STEPS)
    pixels = np.floor(rows * height).astype(np.int64) * width + np.floor(columns * width).astype(np.int64)
    _, first = np.unique(pixels, return_index=True)
    return pixels[np.sort(first)][:CANDIDATES]
