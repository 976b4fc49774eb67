"""The surface of an implicit solid as a closed triangle mesh."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
_BLOCK = 4
_STEEP = 1.5
"""Largest slope of a field over distance, flattened parts included."""

_CORNERS = np.array([[i, j, k] for i in (0, 1) for j in (0, 1) for k in (0, 1)])
_EDGES = [(a, b) for a in range(8) for b in range(a + 1, 8) if np.abs(_CORNERS[a] - _CORNERS[b]).sum() == 1]


def surface(
    field: Callable[[Array], Array], low: Array, high: Array, cell_m: float
) -> tuple[Array, NDArray[np.int64]]:
    """Return the zero level of a field as vertices [m], shape (V, 3), and triangles, shape (T, 3).

    Triangles are counter-clockwise seen from outside, where the field is positive. The mesh is closed if the box
    holds the whole solid.

    Args:
        field: points, shape (n, 3) -> values, shape (n,).
        low, high: corners of the box [m].
        cell_m: spacing of the samples, about the edge length [m].

    Source: Gibson 1998, "Constrained elastic surface nets": a vertex per cell that the surface crosses, at the mean
    of its crossings with the cell's edges; a quad per crossed edge.
    """
    low = cell_m * np.floor(low / cell_m)  # samples at 0, so that a narrow gap there is found
    value = _sampled(field, low - cell_m, np.ceil((high - low) / cell_m).astype(int) + 3, cell_m)
    vertices, number = _vertices(value, low - cell_m, cell_m)
    quads = [_quads(value, number, axis) for axis in range(3)]
    return vertices, _split(vertices, np.concatenate(quads))


def _sampled(field: Callable[[Array], Array], origin: Array, size: NDArray[np.int64], cell_m: float) -> Array:
    """The field on a grid; far from the surface, every sample of a block has the value at its centre."""
    blocks = -(-size // _BLOCK)
    centres = np.stack(np.meshgrid(*(np.arange(n) for n in blocks), indexing="ij"), axis=-1).reshape(-1, 3)
    coarse = field(origin + cell_m * (centres * _BLOCK + 0.5 * (_BLOCK - 1)))
    value = np.repeat(coarse, _BLOCK**3).reshape(*blocks, _BLOCK, _BLOCK, _BLOCK)
    near = np.abs(coarse) < _STEEP * 0.87 * _BLOCK * cell_m
    inner = np.stack(np.meshgrid(*(np.arange(_BLOCK),) * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    fine = centres[near][:, None] * _BLOCK + inner
    value.reshape(-1, _BLOCK**3)[near] = field(origin + cell_m * fine.reshape(-1, 3)).reshape(-1, _BLOCK**3)
    whole = value.transpose(0, 3, 1, 4, 2, 5).reshape(blocks * _BLOCK)
    return whole[: size[0], : size[1], : size[2]]


def _vertices(value: Array, origin: Array, cell_m: float) -> tuple[Array, NDArray[np.int64]]:
    """Vertices, and the vertex index of each cell, -1 = none."""
    cells = np.array(value.shape) - 1
    corner = [value[tuple(slice(c[i], c[i] + cells[i]) for i in range(3))] for c in _CORNERS]
    inside = [c < 0 for c in corner]
    count = sum((c.astype(np.int8) for c in inside), start=np.zeros(corner[0].shape, np.int8))
    crossed = np.nonzero((count > 0) & (count < 8))
    total = np.zeros((len(crossed[0]), 3))
    number_of = np.zeros(len(crossed[0]))
    for a, b in _EDGES:
        va, vb = corner[a][crossed], corner[b][crossed]
        hit = (va < 0) != (vb < 0)
        share = np.where(hit, va / np.where(hit, va - vb, 1.0), 0.0)[:, None]
        total += np.where(hit[:, None], _CORNERS[a] + share * (_CORNERS[b] - _CORNERS[a]), 0.0)
        number_of += hit
    number = np.full(cells, -1)
    number[crossed] = np.arange(len(crossed[0]))
    return origin + cell_m * (np.stack(crossed, axis=-1) + total / number_of[:, None]), number


def _quads(value: Array, number: NDArray[np.int64], axis: int) -> NDArray[np.int64]:
    """Quads of the crossed edges along one axis, shape (Q, 4): the four cells round each edge."""
    moved = np.moveaxis(value, axis, 0)
    cells = np.moveaxis(number, axis, 0)
    inner = moved[:, 1:-1, 1:-1]
    first, second = inner[:-1] < 0, inner[1:] < 0
    i, j, k = np.nonzero(first != second)
    around = np.stack(
        [cells[i, j, k], cells[i, j + 1, k], cells[i, j + 1, k + 1], cells[i, j, k + 1]], axis=-1
    )
    turn = first[i, j, k] != (axis == 1)  # swapping axes 0 and 1 mirrors the order
    return np.where(turn[:, None], around, around[:, ::-1])


def _split(vertices: Array, quads: NDArray[np.int64]) -> NDArray[np.int64]:
    """Split each quad along its shorter diagonal."""
    one = np.linalg.norm(vertices[quads[:, 0]] - vertices[quads[:, 2]], axis=-1)
    two = np.linalg.norm(vertices[quads[:, 1]] - vertices[quads[:, 3]], axis=-1)
    along = quads[:, [0, 1, 2, 0, 2, 3]], quads[:, [1, 2, 3, 1, 3, 0]]
    return np.where((one <= two)[:, None], *along).reshape(-1, 3)
