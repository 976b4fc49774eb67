"""A depth image sampled on a grid around a place, for the networks of hands and heads."""

import numpy as np
from numpy.typing import NDArray

from studio.engine.base.compiled import compiled

Array = NDArray[np.float64]


def sampled(
    depth_mm: NDArray[np.uint16], grid: Array, distance_m: float | Array, band_m: float
) -> tuple[Array, Array, Array]:
    """Return the share of each sample within a band about a distance, that share's distance in front of the band's
    middle [m], and the share without a reading; each of shape (rows, columns), between pixels.

    Args:
        depth_mm: the image, shape (H, W); 0 = no reading.
        grid: column and row of each sample in the image [pixels], shape (rows, columns, 2).
        distance_m: middle of the band, z in the camera frame, of all samples or of each, shape (rows, columns).
        band_m: half depth of the band; points outside are left out.
    """
    filled, nearer, missing = (np.zeros(grid.shape[:2]) for _ in range(3))
    middle = np.zeros(grid.shape[:2])
    middle[:] = distance_m
    _sample(
        np.ascontiguousarray(depth_mm), np.ascontiguousarray(grid), middle, band_m, filled, nearer, missing
    )
    return filled, nearer, missing


@compiled
def _sample(depth_mm, grid, middle, band, filled, nearer, missing):
    """Fill `filled`, `nearer` and `missing` from the four pixels around each sample."""
    height, width = depth_mm.shape
    for i in range(grid.shape[0]):
        for j in range(grid.shape[1]):
            x, y = grid[i, j]
            column, row = int(np.floor(x)), int(np.floor(y))
            for right in range(2):
                for down in range(2):
                    weight = abs(1 - right - (x - column)) * abs(1 - down - (y - row))
                    u, v = column + right, row + down
                    if u < 0 or u >= width or v < 0 or v >= height or depth_mm[v, u] == 0:
                        missing[i, j] += weight
                        continue
                    offset = middle[i, j] - depth_mm[v, u] * 1e-3
                    if abs(offset) < band:
                        filled[i, j] += weight
                        nearer[i, j] += weight * offset
            if filled[i, j] > 0:
                nearer[i, j] /= max(filled[i, j], 1e-9)
