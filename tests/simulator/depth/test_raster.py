"""The rasteriser agrees with rays cast at every triangle; the room agrees with its planes."""

import numpy as np
import pytest

from studio.engine.base.geometry import invert_transform
from studio.engine.model.cameras.depth import DepthCamera
from studio.simulator.performer.figure import Figure
from studio.simulator.rig import look_at
from studio.simulator.sensor.raster import Rasteriser
from studio.simulator.sensor.room import Box, Room, backdrop
from studio.simulator.sensor.sensors import SENSORS

EYE = look_at(np.array([0.6, -2.2, 1.4]), np.array([0.0, 0.0, 1.0]))


def cast(eye, way, vertices, triangles):
    """Nearest hit on a triangle's front, in lengths of `way`; inf = none. Source: Moeller and Trumbore 1997."""
    a, b, c = (vertices[triangles[:, i]].astype(float) for i in range(3))
    e1, e2 = b - a, c - a
    p = np.cross(way, e2)
    determinant = (e1 * p).sum(1)
    with np.errstate(divide="ignore", invalid="ignore"):
        s = eye - a
        u = (s * p).sum(1) / determinant
        q = np.cross(s, e1)
        v = q @ way / determinant
        t = (e2 * q).sum(1) / determinant
    hit = (determinant > 0) & (u >= 0) & (v >= 0) & (u + v <= 1) & (t > 0)
    return t[hit].min() if hit.any() else np.inf


@pytest.mark.parametrize(
    "camera",
    [
        DepthCamera(120, 118, 79.3, 58.7, 160, 120),
        DepthCamera(90, 90, 79.5, 71.5, 160, 144, SENSORS["azure-kinect"].camera.distortion),
    ],
    ids=["pinhole", "distorted"],
)
def test_rasteriser_agrees_with_rays(body, performance, camera):
    vertices = Figure(body, performance).at(42.0)
    depth = np.full((camera.height, camera.width), np.inf, np.float32)
    index = np.full(depth.shape, -1, np.int32)
    Rasteriser(camera).draw(vertices, body.triangles, invert_transform(EYE), depth, index)
    rows, columns = np.nonzero(index >= 0)
    rng = np.random.default_rng(1)
    chosen = rng.choice(len(rows), 30, replace=False)
    pixels = [*zip(rows[chosen], columns[chosen], strict=True), *rng.integers(0, 120, (15, 2))]
    wrong = 0
    for row, column in pixels:
        way = EYE[:3, :3] @ [*camera.rays[row, column].astype(float), 1.0]
        expected = cast(EYE[:3, 3], way, vertices, body.triangles)
        got = depth[row, column]
        wrong += not (got == expected or abs(got - expected) < 2e-3)
    assert wrong <= 1  # a ray that grazes an edge


def test_what_is_behind_the_camera_is_not_drawn(body):
    camera = DepthCamera(100, 100, 31.5, 31.5, 64, 64)
    depth = np.full((64, 64), np.inf, np.float32)
    index = np.full((64, 64), -1, np.int32)
    away = look_at(np.array([0.0, -2.0, 1.0]), np.array([0.0, -4.0, 1.0]))
    Rasteriser(camera).draw(body.vertices_m, body.triangles, invert_transform(away), depth, index)
    assert np.isinf(depth).all() and (index == -1).all()


def test_room_is_where_its_planes_are():
    camera = SENSORS["azure-kinect"].camera
    room = Room((-3.0, -4.0, 0.0), (3.0, 3.0, 2.7), (Box((0.0, 1.0, 0.5), (0.5, 0.3, 0.5), yaw=0.4),))
    seen = backdrop(room, camera, EYE)
    rays = np.concatenate([camera.rays, np.ones((*camera.rays.shape[:2], 1))], axis=2)
    points = (rays * seen.depth_m[..., None]).reshape(-1, 3) @ EYE[:3, :3].T + EYE[:3, 3]
    on_plane = np.min(
        [np.abs(points[:, axis] - limit[axis]) for axis in range(3) for limit in (room.low_m, room.high_m)],
        axis=0,
    )
    turn = np.array([[np.cos(0.4), np.sin(0.4)], [-np.sin(0.4), np.cos(0.4)]])
    inner = np.abs(np.column_stack([(points[:, :2] - [0.0, 1.0]) @ turn.T, points[:, 2] - 0.5])) / [
        0.5,
        0.3,
        0.5,
    ]
    on_box = np.abs(inner.max(axis=1) - 1.0)
    assert np.minimum(on_plane, on_box).max() < 1e-3
    assert (on_box < 1e-3).sum() > 500
    assert 0 <= seen.cosine.min() and seen.cosine.max() <= 1 + 1e-6
