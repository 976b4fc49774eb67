"""Unit shapes of the mannequin's parts: surfaces around the z axis from z = 0 to 1, of radius at most 1."""

from functools import cache

import numpy as np
from numpy.typing import NDArray

# By shape: exponent of the rounded outline, exponent of the cross-section, and (t, relative radius) along it.
_OUTLINES: dict[str, tuple[float, float, tuple[tuple[float, float], ...]]] = {
    "egg": (2.0, 2.0, ((0.0, 1.0), (1.0, 1.0))),
    "limb": (3.6, 2.0, ((0.0, 0.9), (0.28, 1.0), (0.65, 0.85), (1.0, 0.68))),
    "finger": (3.0, 2.0, ((0.0, 1.0), (1.0, 0.88))),
    "chest": (2.8, 2.3, ((0.0, 0.74), (0.3, 0.86), (0.68, 1.0), (1.0, 0.8))),
    "pelvis": (2.7, 2.3, ((0.0, 0.8), (0.45, 1.0), (1.0, 0.86))),
    "palm": (3.2, 2.6, ((0.0, 0.74), (0.55, 1.0), (1.0, 0.96))),
    "foot": (3.4, 2.4, ((0.0, 0.8), (0.3, 0.86), (0.8, 1.0), (1.0, 0.98))),
    "head": (2.3, 2.1, ((0.0, 0.74), (0.3, 0.86), (0.65, 1.0), (1.0, 0.98))),
}

SHAPES: tuple[str, ...] = tuple(_OUTLINES)
"""Names of the unit shapes."""


def surface(shape: str, rings: int, sectors: int) -> NDArray[np.float64]:
    """Return points of a unit shape's surface, shape (rings, sectors, 3), from pole to pole around z."""
    outline, section, radii = _OUTLINES[shape]
    t = 0.5 - 0.5 * np.cos(np.linspace(0.0, np.pi, rings))
    along = _smooth_course(radii, t)
    radius = along * np.clip(1.0 - np.abs(2.0 * t - 1.0) ** outline, 0.0, 1.0) ** (1.0 / outline)
    angle = np.arange(sectors) * (2.0 * np.pi / sectors)
    c, s = np.cos(angle), np.sin(angle)
    round_off = (np.abs(c) ** section + np.abs(s) ** section) ** (-1.0 / section)
    points = np.empty((rings, sectors, 3))
    points[..., 0] = radius[:, None] * (c * round_off)[None, :]
    points[..., 1] = radius[:, None] * (s * round_off)[None, :]
    points[..., 2] = t[:, None]
    return points


def _smooth_course(knots: tuple[tuple[float, float], ...], t: NDArray[np.float64]) -> NDArray[np.float64]:
    places, values = zip(*knots, strict=True)
    if len(knots) == 2:
        return np.interp(t, places, values)
    from scipy.interpolate import pchip_interpolate  # takes long to load: not when the server starts

    return pchip_interpolate(places, values, t)


@cache
def mesh(shape: str, rings: int = 17, sectors: int = 20) -> tuple[NDArray[np.float32], NDArray[np.uint32]]:
    """Return a unit shape as closed triangles facing outwards: vertices (V, 3) and faces (F, 3)."""
    grid = surface(shape, rings, sectors)
    vertices = np.concatenate(
        [grid[:1, :1].reshape(1, 3), grid[1:-1].reshape(-1, 3), grid[-1:, :1].reshape(1, 3)]
    )
    faces: list[tuple[int, int, int]] = []
    last = len(vertices) - 1
    for j in range(sectors):
        k = (j + 1) % sectors
        faces.append((0, 1 + k, 1 + j))
        for i in range(rings - 3):
            a, b = 1 + i * sectors + j, 1 + i * sectors + k
            faces += [(a, b, b + sectors), (a, b + sectors, a + sectors)]
        base = 1 + (rings - 3) * sectors
        faces.append((base + j, base + k, last))
    return vertices.astype(np.float32), np.array(faces, dtype=np.uint32)


def normals(points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return outward unit normals, shape (rings, sectors, 3), of a surface grid of the same shape."""
    around = np.roll(points, -1, axis=1) - np.roll(points, 1, axis=1)
    along = np.gradient(points, axis=0)
    normal = np.cross(around, along)
    normal[0] = normal[1].mean(axis=0)
    normal[-1] = normal[-2].mean(axis=0)
    return normal / np.maximum(np.linalg.norm(normal, axis=-1, keepdims=True), 1e-12)
