"""The room: static floor, walls and furniture, as one camera sees it."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from studio.engine.model.cameras.depth import DepthCamera
from studio.simulator.sensor.view import Image32

Array = NDArray[np.float64]
_HALF_M = 2.7
_AROUND_M = 0.6
_HEIGHT_M = 2.7
_CORNER_M = 0.22
"""Distance from another wall over which multipath light decays by a factor of e."""


@dataclass(frozen=True)
class Box:
    """An upright box: centre and half sizes [m], shape (3,), turned by `yaw` [rad]; its reflectivity."""

    centre_m: tuple[float, float, float]
    half_m: tuple[float, float, float]
    yaw: float = 0.0
    albedo: float = 0.5


@dataclass(frozen=True)
class Room:
    """Walls and furniture.

    Attributes:
        low_m, high_m: corners of the room [m], floor at 0.
        boxes: furniture.
        albedo: reflectivity of floor, walls and ceiling.
    """

    low_m: tuple[float, float, float]
    high_m: tuple[float, float, float]
    boxes: tuple[Box, ...] = ()
    albedo: tuple[float, float, float] = (0.35, 0.7, 0.75)

    @staticmethod
    def around(places_m: Array, *, furniture: bool = False) -> "Room":
        """Return a room around the stage and `places_m`, those of cameras and people, shape (n, 3)."""
        low = np.minimum(places_m.min(axis=0) - _AROUND_M, -_HALF_M)
        high = np.maximum(places_m.max(axis=0) + _AROUND_M, _HALF_M)
        boxes = _furniture(high) if furniture else ()
        return Room((low[0], low[1], 0.0), (high[0], high[1], max(_HEIGHT_M, high[2])), boxes)


def _furniture(high: Array) -> tuple[Box, ...]:
    """A shelf at the back wall, a table, and a chair with a back."""
    x, y = 1.75, min(high[1], _HALF_M)
    legs = [Box((x + dx, 1.2 + dy, 0.22), (0.02, 0.02, 0.22)) for dx in (-0.2, 0.2) for dy in (-0.2, 0.2)]
    return (
        Box((-1.6, y - 0.2, 0.9), (0.45, 0.19, 0.9), albedo=0.6),
        Box((-2.0, 0.6, 0.71), (0.35, 0.6, 0.02), 0.1, 0.55),
        Box((-2.0, 0.6, 0.35), (0.05, 0.05, 0.35), 0.1, 0.3),
        Box((x, 1.2, 0.46), (0.22, 0.22, 0.025), 0.0, 0.4),
        Box((x, 1.41, 0.75), (0.22, 0.02, 0.28), 0.0, 0.4),
        *legs,
    )


@dataclass(frozen=True)
class Backdrop:
    """The room in one camera's image; all of shape (H, W), see `SensorView`."""

    depth_m: Image32
    cosine: Image32
    albedo: Image32
    corner: Image32


def backdrop(room: Room, camera: DepthCamera, T_stage_camera: Array) -> Backdrop:
    """Return the image of the empty room."""
    rays = (
        np.concatenate([camera.rays, np.ones((*camera.rays.shape[:2], 1))], axis=2) @ T_stage_camera[:3, :3].T
    )
    rays = rays.reshape(-1, 3)
    eye = T_stage_camera[:3, 3]
    depth, cosine = np.full(len(rays), np.inf), np.zeros(len(rays))
    albedo, own = np.zeros(len(rays)), np.full(len(rays), -1)
    length = np.linalg.norm(rays, axis=1)
    for axis in range(3):
        for k, limit in enumerate((room.low_m[axis], room.high_m[axis])):
            with np.errstate(divide="ignore"):
                t = (limit - eye[axis]) / rays[:, axis]
            hit = (t > 0.05) & (t < depth) & (np.sign(rays[:, axis]) == (-1, 1)[k])
            depth[hit], cosine[hit] = t[hit], np.abs(rays[hit, axis]) / length[hit]
            albedo[hit] = room.albedo[0 if (axis, k) == (2, 0) else 2 if axis == 2 else 1]
            own[hit] = 2 * axis + k
    for box in room.boxes:
        t, cos = _box_hits(box, eye, rays, length)
        hit = t < depth
        depth[hit], cosine[hit], albedo[hit], own[hit] = t[hit], cos[hit], box.albedo, -1
    points = eye + np.where(np.isfinite(depth), depth, 0.0)[:, None] * rays
    near = nearness(room, points, own)
    shape = camera.rays.shape[:2]
    return Backdrop(*(value.reshape(shape).astype(np.float32) for value in (depth, cosine, albedo, near)))


def nearness(room: Room, points: Array, own: NDArray[np.int64]) -> Array:
    """Return the nearness of points [m], shape (n, 3), to the planes of the room other than their own, 0..1.

    Args:
        own: index of each point's own plane, -1 = none, shape (n,).
    """
    near = np.zeros(len(points))
    for axis in range(3):
        for k, limit in enumerate((room.low_m[axis], room.high_m[axis])):
            gap = np.abs(points[:, axis] - limit)
            near = np.maximum(near, np.where(own == 2 * axis + k, 0.0, np.exp(-gap / _CORNER_M)))
    return near


def _box_hits(box: Box, eye: Array, rays: Array, length: Array) -> tuple[Array, Array]:
    """Distances at which rays enter a box, inf = miss, and the cosine of incidence there."""
    c, s = np.cos(box.yaw), np.sin(box.yaw)
    turn = np.array([[c, s, 0], [-s, c, 0], [0, 0, 1.0]])
    start, way = turn @ (eye - box.centre_m), rays @ turn.T
    with np.errstate(divide="ignore", invalid="ignore"):
        low, high = (-np.array(box.half_m) - start) / way, (np.array(box.half_m) - start) / way
    enter, leave = np.minimum(low, high), np.maximum(low, high)
    axis = np.argmax(enter, axis=1)
    first, last = enter.max(axis=1), leave.min(axis=1)
    hit = (first < last) & (first > 0.05)
    cosine = np.abs(np.take_along_axis(way, axis[:, None], axis=1)[:, 0]) / length
    return np.where(hit, first, np.inf), cosine
