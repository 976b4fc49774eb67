"""Balls and diamonds of the browser view."""

from functools import cache

import numpy as np
from numpy.typing import NDArray


@cache
def ball(rings: int, sectors: int) -> tuple[NDArray[np.float32], NDArray[np.uint32]]:
    """Return a ball of radius 1 around 0 as closed triangles facing outwards: vertices (V, 3) and faces (F, 3).

    Args:
        rings: from pole to pole along z, both counted; 3 with 4 `sectors` is a diamond.
        sectors: around z.
    """
    height = -np.cos(np.linspace(0.0, np.pi, rings))[1:-1, None]
    angle = np.arange(sectors) * (2.0 * np.pi / sectors)
    wide = np.sqrt(1.0 - height**2)
    round_it = np.stack(
        [wide * np.cos(angle), wide * np.sin(angle), np.broadcast_to(height, (rings - 2, sectors))], axis=-1
    )
    vertices = np.concatenate([[[0.0, 0.0, -1.0]], round_it.reshape(-1, 3), [[0.0, 0.0, 1.0]]])
    faces: list[tuple[int, int, int]] = []
    last, top = len(vertices) - 1, 1 + (rings - 3) * sectors
    for j in range(sectors):
        k = (j + 1) % sectors
        faces += [(0, 1 + k, 1 + j), (top + j, top + k, last)]
        for i in range(rings - 3):
            a, b = 1 + i * sectors + j, 1 + i * sectors + k
            faces += [(a, b, b + sectors), (a, b + sectors, a + sectors)]
    return vertices.astype(np.float32), np.array(faces, dtype=np.uint32)
