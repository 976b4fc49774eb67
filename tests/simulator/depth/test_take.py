"""`simulate --tracker depth`: depth and truth of the same performer, the same for the same seed."""

import csv

import numpy as np
import pytest

from studio.engine.base.geometry import transform_points
from studio.engine.model.cameras.depth import points
from studio.engine.model.joints import CANONICAL, INDEX
from studio.simulator.body.performers import PERFORMERS
from studio.simulator.rig import standard_rig
from studio.simulator.sensor.sensors import SENSORS, find_sensor
from studio.simulator.sensor.stage import dropped
from studio.simulator.simulate import SENSORS as NAMES
from studio.simulator.simulate import simulate_take
from studio.take.raw.depth import depth_cameras, depth_frames
from tests.engine.animation.motion.bvh_files import MIXAMO, bvh_text, channel_count


@pytest.fixture(scope="module")
def motion(tmp_path_factory):
    """A BVH of 0.8 s whose hips turn a little."""
    rows = np.zeros((25, channel_count(MIXAMO)))
    rows[:, 1] = 95.0
    rows[:, 4] = np.linspace(0, 20, 25)
    path = tmp_path_factory.mktemp("motion") / "turn.bvh"
    path.write_text(bvh_text(MIXAMO, rows, frame_s=1 / 30))
    return path


def simulate(motion, out, **options):
    options = {"tracker": "depth", "sensor": "azure-kinect", "calibration": False, "cameras": 2} | options
    simulate_take(motion, out, **options)
    return list(depth_frames(out / "raw.mcap"))


@pytest.fixture(scope="module")
def take(motion, tmp_path_factory):
    out = tmp_path_factory.mktemp("take") / "t"
    return out, simulate(motion, out, seed=4)


def truth(out):
    with open(f"{out}.truth.csv") as file:
        rows = list(csv.reader(file))
    return rows[0], np.array(rows[1:], dtype=float)


def test_the_take_holds_depth_of_every_camera(take):
    out, frames = take
    cameras = depth_cameras(out / "raw.mcap")
    assert set(cameras) == {"camera_0", "camera_1"}
    assert cameras["camera_0"] == SENSORS["azure-kinect"].camera
    for name in cameras:
        mine = [frame for frame in frames if frame.camera == name]
        assert 10 <= len(mine) <= 25
        steps = np.diff([frame.device_time_ns for frame in mine]) * 1e-9
        assert (steps > 0).all() and np.median(steps) == pytest.approx(1 / 30, abs=0.006)


def test_the_performer_stands_where_the_truth_says(take):
    """Joints lie in the body: a surface point is near each, and a ray to a joint meets skin before it."""
    out, frames = take
    header, rows = truth(out)
    assert header[: 1 + 3 * len(CANONICAL)][1] == "hips_x"
    assert header[-2:] == ["left_hand_open", "right_hand_open"]
    rig = {camera.name: camera for camera in standard_rig(2)}
    frame = next(frame for frame in frames if frame.camera == "camera_0")
    row = rows[round(frame.device_time_ns * 1e-9 * 120)]
    joints = row[1 : 1 + 3 * len(CANONICAL)].reshape(-1, 3)
    cloud = points(SENSORS["azure-kinect"].camera, frame.depth_mm)[frame.depth_mm > 0].astype(float)
    cloud = transform_points(rig["camera_0"].T_stage_camera, cloud)
    eye = rig["camera_0"].T_stage_camera[:3, 3]
    for name in ("hips", "chest", "head", "left_shoulder", "right_elbow", "left_knee", "right_ankle"):
        joint = joints[INDEX[name]]
        way = (joint - eye) / np.linalg.norm(joint - eye)
        along = (cloud - eye) @ way
        aside = np.linalg.norm(cloud - eye - along[:, None] * way, axis=1)
        gap = np.linalg.norm(joint - eye) - along[aside < 0.03]
        assert len(gap) > 3, name
        assert 0.01 < np.median(gap) < 0.22, name


def test_the_same_seed_gives_the_same_images(motion, take, tmp_path):
    again = simulate(motion, tmp_path / "again", seed=4)
    other = simulate(motion, tmp_path / "other", seed=5)
    assert len(again) == len(take[1])
    for a, b in zip(take[1], again, strict=True):
        assert a.device_time_ns == b.device_time_ns
        np.testing.assert_array_equal(a.depth_mm, b.depth_mm)
    assert other[0].device_time_ns != again[0].device_time_ns
    assert (tmp_path / "again.truth.csv").read_bytes() == (tmp_path / "other.truth.csv").read_bytes()


def test_a_performer_has_its_own_size(motion, tmp_path):
    simulate(motion, tmp_path / "child", performer="scoring-child", sensor="ideal", cameras=1)
    _, rows = truth(tmp_path / "child")
    height = rows[0, 1 + 3 * INDEX["head"] + 2]
    assert height < PERFORMERS["scoring-child"].height_m
    assert height == pytest.approx(0.78 * 0.9, rel=0.1)


def test_few_frames_are_lost_in_bursts():
    lost = dropped(np.random.default_rng(0), 20_000)
    assert 0.004 < lost.mean() < 0.012
    runs = np.diff(np.flatnonzero(np.diff(np.concatenate([[0], lost, [0]]))))[::2]
    assert 1 <= runs.min() and runs.max() <= 6


def test_the_command_offers_every_sensor():
    from studio.__main__ import make_parser

    for name in NAMES:
        args = make_parser().parse_args(
            ["simulate", "demo", "--out", "x", "--tracker", "depth", "--sensor", name]
        )
        assert find_sensor(args.sensor).name == name
