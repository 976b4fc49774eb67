"""Skinned meshes, and the union of closed parts."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from studio.engine.base.geometry import unit

Array = NDArray[np.float64]

BODY, SEAM = 0, 1
"""Tones of a triangle: the body's surface, and the seams between its segments."""

INFLUENCES = 4
"""Most joints per vertex, as in most programs."""


@dataclass(frozen=True)
class SkinnedMesh:
    """A mesh that follows a skeleton by linear blend skinning, in the rest pose.

    Attributes:
        vertices_m: shape (V, 3), float32.
        normals: unit, outwards, shape (V, 3), float32.
        triangles: counter-clockwise seen from outside, shape (T, 3), uint32; those of `SEAM` come last.
        joint_indices: joints that a vertex follows, strongest first, shape (V, 4), uint16.
        weights: shares, each row sums to 1, shape (V, 4), float32.
        tones: `BODY` or `SEAM` by triangle, shape (T,), uint8.
    """

    vertices_m: NDArray[np.float32]
    normals: NDArray[np.float32]
    triangles: NDArray[np.uint32]
    joint_indices: NDArray[np.uint16]
    weights: NDArray[np.float32]
    tones: NDArray[np.uint8]

    def posed(self, rest_m: Array, positions_m: Array, rotations: Array) -> Array:
        """Return the vertices in a pose, shape (V, 3).

        Args:
            rest_m: joint positions of the rest pose, shape (J, 3).
            positions_m: joint positions of the pose, shape (J, 3).
            rotations: from the rest pose to this one, world axes, shape (J, 3, 3).
        """
        shifts = positions_m - np.einsum("jik,jk->ji", rotations, rest_m)
        return self._turned(self.vertices_m, rotations) + self._blended(shifts)

    def posed_normals(self, rotations: Array) -> Array:
        """Return the unit normals in a pose, shape (V, 3), of `rotations` as `posed` takes them."""
        return unit(self._turned(self.normals, rotations))

    def _turned(self, vectors: NDArray[np.float32], rotations: Array) -> Array:
        turns = self._blended(rotations.reshape(-1, 9)).reshape(-1, 3, 3)
        return np.einsum("vij,vj->vi", turns, vectors)

    def _blended(self, values: Array) -> Array:
        """The joints' values, shape (J, n), blended for each vertex, shape (V, n)."""
        return np.einsum("vk,vkn->vn", self.weights, values[self.joint_indices])


@dataclass(frozen=True)
class MannequinPart:
    """A closed surface: points (V, 3), triangles (T, 3), weights over all joints (V, J), and its tone."""

    points: Array
    triangles: NDArray[np.int64]
    weights: Array
    tone: int


def join(parts: list[MannequinPart]) -> SkinnedMesh:
    """Return the parts as one mesh, the weights reduced to the four strongest of each vertex."""
    parts = sorted(parts, key=lambda part: part.tone)
    starts = np.cumsum([0, *(len(part.points) for part in parts)])
    weights = np.concatenate([part.weights for part in parts])
    strongest = np.argsort(-weights, axis=1, kind="stable")[:, :INFLUENCES]
    shares = np.take_along_axis(weights, strongest, axis=1)
    shares /= shares.sum(axis=1, keepdims=True)
    strongest[shares == 0.0] = 0
    normals = np.concatenate([vertex_normals(part.points, part.triangles) for part in parts])
    triangles = [part.triangles + start for part, start in zip(parts, starts, strict=False)]
    return SkinnedMesh(
        vertices_m=np.concatenate([part.points for part in parts]).astype(np.float32),
        normals=normals.astype(np.float32),
        triangles=np.concatenate(triangles).astype(np.uint32),
        joint_indices=strongest.astype(np.uint16),
        weights=shares.astype(np.float32),
        tones=np.concatenate([np.full(len(part.triangles), part.tone, np.uint8) for part in parts]),
    )


def vertex_normals(points: Array, triangles: NDArray[np.int64]) -> Array:
    """Return unit normals by vertex, shape (V, 3): means of the adjacent triangles' weighted by area."""
    corners = points[triangles]
    faces = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals = np.zeros_like(points)
    for k in range(3):
        np.add.at(normals, triangles[:, k], faces)
    return normals / np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-12)
