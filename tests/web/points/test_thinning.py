"""Thinning in numbers: points lie on the skin and on the floor, most about the performer, within the budget."""

from functools import cache

import numpy as np
import pytest
from scipy.spatial import cKDTree

from studio.engine.base.geometry import transform_points
from studio.engine.model.cameras.depth import points as all_points
from studio.web.points.maker import BUDGET_BYTES_S, COLOURS, RATE_HZ, points_each
from studio.web.points.thinning import NEAR_SHARE, StageSpace, Thinner
from studio.web.scene.clouds import ORIGIN_M
from tests.web.points.depth_takes import calibration, images, joints, skin, stage

COUNT = 6000


@cache
def around() -> StageSpace:
    """The space about the performer."""
    return StageSpace.about(joints(), 0.3)


def thinned(index: int, sensor: str = "ideal") -> np.ndarray:
    camera = calibration().cameras[f"camera_{index}"]
    return Thinner(stage(sensor).sensor.camera).points(
        images(sensor)[index], camera.T_stage_camera, COUNT, around()
    )


def to_triangles(points: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Distance of each point to its triangle [m]; points (N, 3), triangles (N, 3, 3)."""
    a, b, c = np.moveaxis(triangles, 1, 0)
    normal = np.cross(b - a, c - a)
    normal /= np.maximum(np.linalg.norm(normal, axis=1), 1e-12)[:, None]
    height = ((points - a) * normal).sum(axis=1)
    foot = points - height[:, None] * normal
    inside = np.ones(len(points), dtype=bool)
    edges = []
    for p, q in ((a, b), (b, c), (c, a)):
        inside &= (np.cross(q - p, foot - p) * normal).sum(axis=1) >= 0
        share = ((points - p) * (q - p)).sum(axis=1) / np.maximum(((q - p) ** 2).sum(axis=1), 1e-12)
        edges.append(np.linalg.norm(p + np.clip(share, 0, 1)[:, None] * (q - p) - points, axis=1))
    return np.where(inside, np.abs(height), np.min(edges, axis=0))


def to_skin(points: np.ndarray) -> np.ndarray:
    """Distance of each point to the performer's skin [m]."""
    vertices, faces = skin()
    _, nearest = cKDTree(vertices[faces].mean(axis=1)).query(points, k=24)
    return np.min([to_triangles(points, vertices[faces[some]]) for some in nearest.T], axis=0)


@pytest.mark.parametrize("index", [0, 1])
def test_points_lie_on_the_skin_and_on_the_floor_to_the_millimetre(index):
    points = thinned(index)
    sent = (points - ORIGIN_M).astype(np.float16).astype(float) + ORIGIN_M
    low, high = joints().min(axis=0) - 0.3, joints().max(axis=0) + 0.3
    about = ((sent > low) & (sent < high)).all(axis=1)
    floor = about & (np.abs(sent[:, 2]) < 0.02)
    body = about & (sent[:, 2] > 0.15)
    assert floor.sum() > 300 and body.sum() > 1000
    assert np.percentile(np.abs(sent[floor, 2]), 90) < 0.0015
    away = to_skin(sent[body])
    assert np.median(away) < 0.001 and np.percentile(away, 99) < 0.002
    assert np.abs(sent - points)[np.linalg.norm(points - ORIGIN_M, axis=1) < 2].max() < 0.00055


@pytest.mark.parametrize("sensor", ["ideal", "azure-kinect"])
def test_every_point_is_one_of_the_image(sensor):
    """The same as with all pixels and the engine's own functions, also through a lens that bends rays."""
    camera, T = stage(sensor).sensor.camera, calibration().cameras["camera_0"].T_stage_camera
    depth_mm = images(sensor)[0]
    whole = transform_points(T, all_points(camera, depth_mm)[depth_mm > 0].astype(float))
    points = thinned(0, sensor)
    assert len(points) == COUNT == len(np.unique(points, axis=0))
    assert cKDTree(whole).query(points)[0].max() < 1e-5


def test_most_points_lie_about_the_performer():
    points = thinned(0)
    inside = ((points > around().low_m) & (points < around().high_m)).all(axis=1)
    assert inside.sum() == pytest.approx(NEAR_SHARE * COUNT, abs=1)
    everywhere = Thinner(stage().sensor.camera).points(
        images()[0], calibration().cameras["camera_0"].T_stage_camera, COUNT, None
    )
    assert len(everywhere) == COUNT
    assert ((everywhere > around().low_m) & (everywhere < around().high_m)).all(axis=1).sum() < inside.sum()


def test_points_are_spread_evenly_and_stay_the_same():
    """Of an image that is all valid every part gives its share, and the next image gives the same pixels."""
    camera = stage().sensor.camera
    thinner = Thinner(camera)
    flat = np.full((camera.height, camera.width), 2000, dtype=np.uint16)
    points = thinner.points(flat, np.eye(4), 3600, None).copy()
    columns = np.round(points[:, 0] / 2.0 * camera.fx + camera.cx).astype(int)
    rows = np.round(points[:, 1] / 2.0 * camera.fy + camera.cy).astype(int)
    counts, *_ = np.histogram2d(columns, rows, bins=(16, 16), range=((0, camera.width), (0, camera.height)))
    assert counts.min() > 0.5 * 3600 / 256 and counts.max() < 1.6 * 3600 / 256
    assert np.array_equal(thinner.points(flat, np.eye(4), 3600, None), points)


def test_nothing_is_made_of_nothing():
    camera = stage().sensor.camera
    empty = np.zeros((camera.height, camera.width), dtype=np.uint16)
    assert len(Thinner(camera).points(empty, np.eye(4), COUNT, around())) == 0
    assert StageSpace.about(np.full((21, 3), np.nan), 0.3) is None
    with pytest.raises(ValueError, match="camera has"):
        Thinner(camera).points(empty[1:], np.eye(4), COUNT, None)


@pytest.mark.parametrize("colour", COLOURS)
@pytest.mark.parametrize("cameras", [1, 2, 3, 4, 8])
def test_the_budget_holds(colour, cameras):
    bytes_s = points_each(colour, cameras) * cameras * COLOURS[colour] * RATE_HZ
    assert 0.99 * BUDGET_BYTES_S < bytes_s <= BUDGET_BYTES_S
