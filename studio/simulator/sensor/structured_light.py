"""Noise of a structured-light camera, or active stereo, on an exact image."""

import numpy as np
from numpy.typing import NDArray

from studio.engine.base.compiled import compiled
from studio.simulator.sensor.sensors import Sensor, StructuredLight
from studio.simulator.sensor.view import Image32, SensorView

_BLOB_PX = 7
"""Size of the patches that other cameras' patterns blank out."""

_JUMP_M = 0.06
"""Smallest depth difference of neighbours at an edge, plus 2 % of the distance."""

_FAR_PX = 97
"""Column offset of a pixel's second, independent random number."""

DISTURBED: tuple[float, ...] = (0.004, 0.014, 0.05, 0.38)
"""Share of an image at 2.5 m without a reading, by the number of structured-light cameras. One to three are usable,
four are not, as in the thesis. It grows with the square of the distance, as the camera's own light fades.
"""


def measure(sensor: Sensor, view: SensorView, rng: np.random.Generator, cameras: int) -> NDArray[np.uint16]:
    """Return the depth image [mm], shape (H, W); 0 = no reading.

    Noise affects the disparity, which is rounded to steps, so depth noise and steps grow with the square of the
    distance. Edges are ragged. Surfaces that the projector (or the second camera) does not reach are in shadow.

    Args:
        cameras: number of structured-light cameras, this one included.
    """
    family = sensor.family
    assert isinstance(family, StructuredLight)
    shape = view.depth_m.shape
    noise = rng.standard_normal(shape, dtype=np.float32)
    if family.patch_px:
        noise = (0.35 * noise + _patches(rng, shape, family.patch_px)).astype(np.float32)
    level = min(cameras, len(DISTURBED)) - 1 if family.disturbed else 0
    return _measure(
        view.depth_m,
        view.cosine,
        view.albedo,
        np.array([sensor.camera.fx * family.baseline_m, family.disparity_noise_px * (1 + 0.1 * level),
                  family.disparity_step_px, family.edge_noise_px, family.lost_at_edge,
                  DISTURBED[level], *sensor.range_m]),
        noise,
        rng.standard_normal(shape, dtype=np.float32),
        _quantiles(_patches(rng, shape, _BLOB_PX)) if family.disturbed else np.ones(shape, np.float32),
        rng.random(shape, dtype=np.float32),
    )  # fmt: skip


def _patches(rng: np.random.Generator, shape: tuple[int, ...], size: int) -> Image32:
    """Smooth noise of SD about 1, in patches of this size [pixels]."""
    coarse = rng.standard_normal((shape[0] // size + 3, shape[1] // size + 3), dtype=np.float32)
    return _bilinear(coarse, shape[0], shape[1], size, *rng.random(2))


@compiled
def _bilinear(coarse: Image32, height: int, width: int, size: int, down: float, right: float) -> Image32:
    """Values interpolated in a coarse grid, shifted by a fraction of a cell and rescaled to an SD of about 1."""
    out = np.empty((height, width), np.float32)
    for row in range(height):
        y = row / size + down
        i = int(y)
        v = np.float32(y - i)
        for column in range(width):
            x = column / size + right
            j = int(x)
            u = np.float32(x - j)
            top = (1 - u) * coarse[i, j] + u * coarse[i, j + 1]
            out[row, column] = 1.5 * (
                (1 - v) * top + v * ((1 - u) * coarse[i + 1, j] + u * coarse[i + 1, j + 1])
            )
    return out


def _quantiles(patches: Image32) -> Image32:
    """Approximately uniform values 0..1 from smooth noise, constant over its patches."""
    return (1 / (1 + np.exp(-1.7 * patches))).astype(np.float32)


@compiled
def _at_edge(depth: Image32, row: int, column: int) -> bool:
    """Whether a neighbour lies at another depth."""
    z = depth[row, column]
    limit = _JUMP_M + 0.02 * z
    return (
        abs(depth[max(row - 1, 0), column] - z) > limit
        or abs(depth[min(row + 1, depth.shape[0] - 1), column] - z) > limit
        or abs(depth[row, max(column - 1, 0)] - z) > limit
        or abs(depth[row, min(column + 1, depth.shape[1] - 1)] - z) > limit
    )


@compiled
def _measure(
    depth: Image32,
    cosine: Image32,
    albedo: Image32,
    family: NDArray[np.float64],
    noise: Image32,
    aside: Image32,
    blobs: Image32,
    chance: Image32,
) -> NDArray[np.uint16]:
    focal_baseline, noise_px, step_px, edge_px, lost, disturbed, near, far = family
    height, width = depth.shape
    out = np.zeros((height, width), np.uint16)
    for row in range(height):
        reached = 1e9  # leftmost projector column used so far, from the right
        for column in range(width - 1, -1, -1):
            z = depth[row, column]
            if not z < 30.0:
                continue
            place = column - focal_baseline / z
            if place > reached + 0.5:
                continue  # in the shadow of a nearer surface to its right
            reached = min(reached, place)
            if _at_edge(depth, row, column) and chance[row, column] < lost:
                continue
            i = round(row + edge_px * aside[row, column])
            j = round(column + edge_px * aside[row, (column + _FAR_PX) % width])
            i, j = min(max(i, 0), height - 1), min(max(j, 0), width - 1)
            if abs(depth[i, j] - z) > 0.05:
                z = depth[i, j]  # an edge appears slightly shifted
                if not z < 30.0:
                    continue
            cos = cosine[i, j]
            if cos < 0.12 + 0.1 * chance[row, column]:
                continue  # the pattern is too oblique to be matched
            if albedo[i, j] * cos / (z * z) < 0.002 * (0.5 + chance[row, column]):
                continue
            if blobs[row, column] < disturbed * z * z / 6.25:
                continue
            disparity = focal_baseline / z + noise_px * noise[row, column] * (1 + 0.1 * (1 / cos - 1))
            disparity = round(disparity / step_px) * step_px
            if disparity <= 0:
                continue
            z = focal_baseline / disparity
            if near <= z <= far:
                out[row, column] = np.uint16(1e3 * z + 0.5)
    return out
