"""A robot's look: triangles of its bodies, with less detail than its meshes."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import product

import mujoco
import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull

from studio.engine.base.geometry import matrices
from studio.engine.robots.body.robot import Robot

Array = NDArray[np.float64]
Rgb = tuple[int, int, int]
Mesh = tuple[Array, NDArray[np.int64]]
"""Vertices [m], shape (vertex_count, 3), and triangles, shape (triangle_count, 3)."""

VISIBLE_GROUPS = (0, 1, 2)
"""Groups of geoms that MuJoCo shows; others are for collisions, and shown only where a robot has nothing else."""

CELL_M = 0.006
"""Size of a cell whose vertices become one."""

BONE_M = 0.025
"""Radius of the capsules of a robot without any geoms."""

_AROUND, _ALONG = 20, 11


@dataclass(frozen=True)
class Shape:
    """Triangles of one colour that belong to one body.

    Attributes:
        body: number of the body in the model.
        vertices_m: in the body's axes [m], shape (vertex_count, 3).
        triangles: shape (triangle_count, 3), facing outwards.
        rgb: colour, 0..255.
    """

    body: int
    vertices_m: NDArray[np.float32]
    triangles: NDArray[np.int64]
    rgb: Rgb


def robot_shapes(robot: Robot) -> list[Shape]:
    """Return a robot's shapes: its meshes and other geoms; in a model without meshes, bodies without geoms get
    capsules along their bones."""
    model = robot.model
    parts: dict[tuple[int, Rgb], list[Mesh]] = {}
    for geom in seen_geoms(model):
        made = _triangles(model, int(geom))
        if made is not None:
            key = int(model.geom_bodyid[geom]), _colour(model, int(geom))
            place = made[0] @ matrices(model.geom_quat[geom]).T + model.geom_pos[geom]
            parts.setdefault(key, []).append((place, made[1]))
    for body, end in bare_bones(model):
        points = np.concatenate([BONE_M * _BALL, BONE_M * _BALL + end])
        parts.setdefault((body, _GREY), []).append(_hull(points))
    return [_shape(body, rgb, pieces) for (body, rgb), pieces in parts.items()]


_GREY = (128, 128, 128)


def _shape(body: int, rgb: Rgb, pieces: list[Mesh]) -> Shape:
    first = np.cumsum([0, *(len(vertices) for vertices, _ in pieces[:-1])])
    return Shape(
        body,
        np.concatenate([vertices for vertices, _ in pieces]).astype(np.float32),
        np.concatenate([faces + start for (_, faces), start in zip(pieces, first, strict=True)]),
        rgb,
    )


def _colour(model: mujoco.MjModel, geom: int) -> Rgb:
    material = model.geom_matid[geom]
    rgba = model.mat_rgba[material] if material >= 0 else model.geom_rgba[geom]
    red, green, blue = (round(255.0 * float(part)) for part in rgba[:3])
    return red, green, blue


def _triangles(model: mujoco.MjModel, geom: int) -> Mesh | None:
    """Vertices in the geom's axes, and triangles; None for a geom without a surface."""
    kind = mujoco.mjtGeom(int(model.geom_type[geom]))
    if kind == mujoco.mjtGeom.mjGEOM_MESH:
        mesh = model.geom_dataid[geom]
        first, count = model.mesh_vertadr[mesh], model.mesh_vertnum[mesh]
        begin, faces = model.mesh_faceadr[mesh], model.mesh_facenum[mesh]
        return simplified(
            model.mesh_vert[first : first + count].astype(np.float64),
            model.mesh_face[begin : begin + faces].astype(np.int64),
        )
    points = _POINTS.get(kind)
    return None if points is None else _hull(points(model.geom_size[geom]))


def simplified(vertices: Array, triangles: NDArray[np.int64]) -> Mesh:
    """Return a mesh with one vertex for each cell of `CELL_M`, the mean of the vertices in it."""
    _, cell = np.unique(np.floor(vertices / CELL_M).astype(np.int64), axis=0, return_inverse=True)
    cell = cell.reshape(-1)
    count = np.bincount(cell)
    middle = np.stack([np.bincount(cell, vertices[:, k]) / count for k in range(3)], axis=1)
    merged = cell[triangles]
    a, b, c = merged.T
    merged = merged[(a != b) & (b != c) & (c != a)]
    turn = merged.argmin(axis=1)  # the same triangle begins at the same corner
    merged = np.take_along_axis(merged, (turn[:, None] + np.arange(3)) % 3, axis=1)
    return middle, np.unique(merged, axis=0)


def _hull(points: Array) -> Mesh:
    """The convex hull of points, its triangles facing outwards."""
    hull = ConvexHull(points)
    faces = hull.simplices.astype(np.int64)
    a, b, c = (points[faces[:, k]] for k in range(3))
    inward = (np.cross(b - a, c - a) * hull.equations[:, :3]).sum(axis=1) < 0.0
    faces[inward] = faces[inward][:, ::-1]
    return points, faces


def _ball() -> Array:
    turn, tilt = (
        one.ravel()
        for one in np.meshgrid(
            2.0 * np.pi * np.arange(_AROUND) / _AROUND, np.linspace(0.0, np.pi, _ALONG + 1)[1:-1]
        )
    )
    ring = np.stack([np.sin(tilt) * np.cos(turn), np.sin(tilt) * np.sin(turn), np.cos(tilt)], axis=1)
    return np.concatenate([ring, [[0.0, 0.0, 1.0], [0.0, 0.0, -1.0]]])


def _capsule(size: Array) -> Array:
    ends = np.array([[0.0, 0.0, size[1]], [0.0, 0.0, -size[1]]])
    return (ends[:, None] + size[0] * _BALL).reshape(-1, 3)


def _cylinder(size: Array) -> Array:
    turn = 2.0 * np.pi * np.arange(_AROUND) / _AROUND
    ring = size[0] * np.stack([np.cos(turn), np.sin(turn)], axis=1)
    return np.concatenate([np.column_stack([ring, np.full(_AROUND, z)]) for z in (size[1], -size[1])])


_BALL = _ball()
_POINTS: dict[mujoco.mjtGeom, Callable[[Array], Array]] = {
    mujoco.mjtGeom.mjGEOM_SPHERE: lambda size: _BALL * size[0],
    mujoco.mjtGeom.mjGEOM_ELLIPSOID: lambda size: _BALL * size,
    mujoco.mjtGeom.mjGEOM_BOX: lambda size: np.array(list(product((-1.0, 1.0), repeat=3))) * size,
    mujoco.mjtGeom.mjGEOM_CAPSULE: _capsule,
    mujoco.mjtGeom.mjGEOM_CYLINDER: _cylinder,
}
"""Kind of geom -> function of its size that returns points whose convex hull is the geom."""


def bare_bones(model: mujoco.MjModel) -> Iterator[tuple[int, Array]]:
    """Yield each body without a visible geom in a model without meshes, and the position of each child body in its
    axes [m], shape (3,); a capsule shows each."""
    own = np.flatnonzero(model.geom_bodyid > 0)
    if (model.geom_type[own] == mujoco.mjtGeom.mjGEOM_MESH).any():
        return
    shown = {int(model.geom_bodyid[geom]) for geom in seen_geoms(model)}
    for child in range(2, model.nbody):
        body, end = int(model.body_parentid[child]), model.body_pos[child]
        if body not in shown and np.linalg.norm(end) > BONE_M:
            yield body, end


def seen_geoms(model: mujoco.MjModel) -> NDArray[np.int64]:
    """Return the geoms of bodies that are shown: the visible ones, or all where none is visible."""
    own = np.flatnonzero(model.geom_bodyid > 0)
    seen = own[np.isin(model.geom_group[own], VISIBLE_GROUPS) & (model.geom_rgba[own, 3] > 0.0)]
    return seen if len(seen) else own
