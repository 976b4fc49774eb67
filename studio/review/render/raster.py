"""Rasterisation of triangles with numpy alone: the nearest triangle at the centre of every pixel."""

import numpy as np
from numpy.typing import NDArray

_EDGE = 1e-9


def nearest(
    seen: NDArray[np.float64], triangles: NDArray[np.uint32], width: int, height: int
) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.float64], NDArray[np.float64]]:
    """Return the pixels that triangles cover, and the triangle at each.

    Args:
        seen: vertices: right and down [px], and depth away from the viewer [m], shape (V, 3).
        triangles: counter-clockwise seen from outside, shape (T, 3); back faces are skipped.
        width, height: of the picture [px].

    Returns:
        pixels: row * width + column, each once, shape (n,).
        triangle: index of the nearest triangle, shape (n,).
        shares: barycentric coordinates, shape (n, 3).
        depth: [m], shape (n,).
    """
    corners = seen[triangles]
    a, ab, ac = corners[:, 0], corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    area = ab[:, 1] * ac[:, 0] - ab[:, 0] * ac[:, 1]  # rows point down: positive = seen from outside
    size = np.array([width, height])
    low = np.ceil(corners[:, :, :2].min(axis=1) - 0.5).clip(0, size).astype(int)
    high = np.floor(corners[:, :, :2].max(axis=1) - 0.5).clip(-1, size - 1).astype(int)
    extent = high - low + 1
    drawn = np.flatnonzero((area > _EDGE) & (extent > 0).all(axis=1))
    boxes = 2 ** np.ceil(np.log2(extent[drawn])).astype(int)  # few sizes: triangles are drawn in bulk
    none = np.zeros(0, dtype=np.int64)
    found = [(none, np.zeros(0), np.zeros(0), none)]
    for wide, high_px in np.unique(boxes, axis=0):
        some = drawn[(boxes == (wide, high_px)).all(axis=1)]
        x = low[some, 0, None, None] + np.arange(wide)
        y = low[some, 1, None, None] + np.arange(high_px)[:, None]
        right, down = x + 0.5 - a[some, 0, None, None], y + 0.5 - a[some, 1, None, None]
        (bx, by, _), (cx, cy, _) = ab[some].T[..., None, None], ac[some].T[..., None, None]
        to_b = (down * cx - right * cy) / area[some, None, None]
        to_c = (right * by - down * bx) / area[some, None, None]
        inside = (
            (to_b >= -_EDGE) & (to_c >= -_EDGE) & (to_b + to_c <= 1.0 + _EDGE) & (x < width) & (y < height)
        )
        which, _, _ = at = np.nonzero(inside)
        found.append((some[which], to_b[at], to_c[at], (y * width + x)[at]))
    triangle, to_b, to_c, pixel = (np.concatenate(part) for part in zip(*found, strict=True))
    depth = a[triangle, 2] + to_b * ab[triangle, 2] + to_c * ac[triangle, 2]
    order = np.argsort(-depth, kind="stable")  # far to near: the nearest stays
    winner = np.full(width * height, -1)
    winner[pixel[order]] = order
    pixels = np.flatnonzero(winner >= 0)
    first = winner[pixels]
    shares = np.stack([1.0 - to_b[first] - to_c[first], to_b[first], to_c[first]], axis=1)
    return pixels, triangle[first], shares, depth[first]
