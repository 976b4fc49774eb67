"""The shapes of props: distances from their surface, and points on it."""

import numpy as np
from numpy.typing import NDArray

from studio.engine.model.rigid_body import RigidShape

Array = NDArray[np.float64]


def axis_of(shape: RigidShape) -> int:
    """Return the body axis along which a shape is longest."""
    return int(shape.edges_m.argmax())


def is_long(shape: RigidShape) -> bool:
    """Whether a shape is a stick: at least three times as long as thick."""
    edges = np.sort(shape.edges_m)
    return bool(edges[2] >= 3.0 * edges[1])


def turns_of(shape: RigidShape) -> Array:
    """Return the body's axes about which rotations can be seen, shape (k, 3): none for a ball, and not a cylinder's
    own axis."""
    if shape.kind == "sphere":
        return np.empty((0, 3))
    if shape.kind == "cylinder":
        return np.delete(np.eye(3), "xyz".index(shape.axis), axis=0)
    return np.eye(3)


def distances_m(shape: RigidShape, points_m: Array) -> Array:
    """Return the signed distance of points from the surface [m], negative inside; points in the body's axes, shape
    (..., 3).

    Source: Quilez, "Distance functions" (exact box, capped cylinder, sphere).
    """
    half = shape.edges_m / 2
    if shape.kind == "sphere":
        return np.linalg.norm(points_m, axis=-1) - half[0]
    if shape.kind == "cylinder":
        along = "xyz".index(shape.axis)
        across = np.linalg.norm(np.delete(points_m, along, axis=-1), axis=-1)
        out = np.stack(
            [across - np.delete(half, along)[0], np.abs(points_m[..., along]) - half[along]], axis=-1
        )
    else:
        out = np.abs(points_m) - half
    return np.linalg.norm(np.maximum(out, 0.0), axis=-1) + np.minimum(out.max(axis=-1), 0.0)


def surface(shape: RigidShape, count: int) -> tuple[Array, Array]:
    """Return about `count` points evenly on the surface [m] and their normals, in the body's axes, shape (n, 3)."""
    half = shape.edges_m / 2
    if shape.kind == "sphere":
        normals = _ball(count)
        return half[0] * normals, normals
    if shape.kind == "cylinder":
        return _cylinder(half, "xyz".index(shape.axis), count)
    areas = np.array([half[1] * half[2], half[2] * half[0], half[0] * half[1]])
    spacing = np.sqrt(8 * areas.sum() / count)
    places, normals = [], []
    for axis in range(3):
        others = [k for k in range(3) if k != axis]
        steps = [_steps(half[k], spacing) for k in others]
        grid = np.stack(np.meshgrid(*steps, indexing="ij"), axis=-1).reshape(-1, 2)
        for sign in (-1.0, 1.0):
            face = np.full((len(grid), 3), sign * half[axis])
            face[:, others] = grid
            places.append(face)
            normals.append(np.tile(sign * np.eye(3)[axis], (len(grid), 1)))
    return np.concatenate(places), np.concatenate(normals)


def _steps(half: float, spacing: float) -> Array:
    count = max(2, round(2 * half / spacing))
    return (np.arange(count, dtype=np.float64) + 0.5) * (2 * half / count) - half


def _ball(count: int) -> Array:
    """Return directions spread evenly over a ball. Source: the Fibonacci lattice."""
    k = np.arange(count) + 0.5
    z, angle = 1.0 - 2.0 * k / count, np.pi * (1.0 + 5.0**0.5) * k
    r = np.sqrt(1.0 - z * z)
    return np.stack([r * np.cos(angle), r * np.sin(angle), z], axis=1)


def _cylinder(half: Array, along: int, count: int) -> tuple[Array, Array]:
    """Return points on the side of a cylinder and on its two ends."""
    others = [k for k in range(3) if k != along]
    radius, length = half[others[0]], half[along]
    around = 8
    angles = np.arange(around) * 2 * np.pi / around
    steps = _steps(length, 2 * length / max(4, count // around))
    normals = np.zeros((around, 3))
    normals[:, others] = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    side = radius * normals[None] + steps[:, None, None] * np.eye(3)[along]
    ends = [
        np.tile(sign * length * np.eye(3)[along], (around, 1)) + 0.6 * radius * normals for sign in (-1, 1)
    ]
    caps = [np.tile(sign * np.eye(3)[along], (around, 1)) for sign in (-1, 1)]
    return np.concatenate([side.reshape(-1, 3), *ends]), np.concatenate(
        [np.tile(normals, (len(steps), 1)), *caps]
    )
