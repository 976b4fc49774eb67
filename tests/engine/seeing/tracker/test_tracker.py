"""The tracker on simulated and recorded depth: error, determinism, leaving and coming back, bad images."""

from dataclasses import replace

import numpy as np
import pytest

from studio.engine.animation.motion.torture import arms_crossed
from studio.engine.base.errors import CalibrationError, FormatError
from studio.engine.model.calibration import Calibration, CameraCalibration
from studio.engine.model.cameras.depth import DepthFrame
from studio.engine.seeing.tracker.skeletons import POINTS, frame_sets, from_points, per_camera
from studio.engine.seeing.tracker.tracker import Tracker
from tests.engine.seeing.tracker.scenes import LIMBS, PUNCHES, recorded, simulated, truth_at
from tests.refused import refused


@pytest.fixture(scope="module")
def scene():
    """A person who stands and begins to cross the arms, for 0.7 s."""
    return simulated(arms_crossed(), end_s=0.7)


def followed(tracker, sets):
    return [tracker.track(images) for images in sets]


def test_somebody_is_found_and_followed(scene):
    cameras, placed, sets, truth = scene
    skeletons = followed(Tracker(cameras, placed), sets)
    assert {skeleton.status for skeleton in skeletons} == {"tracked"}
    errors = np.linalg.norm(np.stack([s.positions for s in skeletons]) - truth, axis=2)[:, LIMBS]
    assert errors.mean() < 0.05 and errors[-1].max() < 0.15
    assert np.mean([s.confidence[LIMBS].mean() for s in skeletons]) > 0.75


def test_a_camera_alone_needs_no_transform(scene):
    cameras, placed, sets, truth = scene
    (T,) = placed.values()
    skeleton = followed(Tracker(cameras), sets[:4])[-1]
    on_stage = skeleton.positions @ T[:3, :3].T + T[:3, 3]
    assert np.linalg.norm(on_stage - truth[3], axis=1)[LIMBS].mean() < 0.06


def test_the_same_images_give_the_same_skeletons(scene):
    cameras, placed, sets, _ = scene
    first, second = (followed(Tracker(cameras, placed), sets[:5]) for _ in range(2))
    for a, b in zip(first, second, strict=True):
        assert (a.positions == b.positions).all() and (a.confidence == b.confidence).all()


@pytest.mark.parametrize("known", [False, True])
def test_who_leaves_is_lost_and_found_again(scene, known):
    cameras, placed, sets, truth = scene
    ((name, camera),) = cameras.items()
    tracker = Tracker(cameras, placed)
    followed(tracker, sets[:3])
    if known:
        tracker.bodies[0].learnt = 100
    empty = np.zeros((camera.height, camera.width), np.uint16)
    later = [
        {name: DepthFrame(name, 10 + k, sets[2][name].device_time_ns + (k + 1) * 33_333_333, empty)}
        for k in range(12)
    ]
    gone = followed(tracker, later)
    assert gone[-1].status == "lost" and np.isnan(gone[-1].positions).all() and not gone[-1].confidence.any()
    back = [
        {name: replace(images[name], device_time_ns=images[name].device_time_ns + 2 * 10**9)}
        for images in sets[3:9]
    ]
    skeleton = followed(tracker, back)[-1]
    assert skeleton.status == "tracked"
    assert np.linalg.norm(skeleton.positions - truth[8], axis=1)[LIMBS].mean() < 0.06
    assert (tracker.bodies[0].learnt > 100) == known


@pytest.mark.parametrize("value", [0, 3000, 65535])
def test_images_without_anybody(scene, value):
    cameras, _, _, _ = scene
    ((name, camera),) = cameras.items()
    image = np.full((camera.height, camera.width), value, np.uint16)
    skeletons = followed(
        Tracker(cameras), [{name: DepthFrame(name, k, k * 33_333_333, image)} for k in range(4)]
    )
    assert {s.status for s in skeletons} == {"searching"} and not any(s.confidence.any() for s in skeletons)


def test_upside_down_nobody_is_surely_seen(scene):
    cameras, _, sets, _ = scene
    ((name, _),) = cameras.items()
    turned = [{name: replace(s[name], depth_mm=s[name].depth_mm[::-1, ::-1].copy())} for s in sets[:4]]
    assert all(s.confidence.mean() < 0.75 for s in followed(Tracker(cameras), turned))


def test_an_image_of_another_size_is_an_error(scene):
    cameras, _, _, _ = scene
    ((name, _),) = cameras.items()
    with refused(FormatError, "depth.image_size"):
        Tracker(cameras).track({name: DepthFrame(name, 0, 0, np.zeros((4, 5), np.uint16))})


def test_several_cameras_need_transforms(scene):
    cameras, _, _, _ = scene
    two = {"a": next(iter(cameras.values())), "b": next(iter(cameras.values()))}
    with refused(CalibrationError, "tracker.no_transforms"):
        Tracker(two)
    with refused(CalibrationError, "tracker.no_transform"):
        Tracker(two, {"a": np.eye(4)})


def test_image_sets_hold_every_camera_once():
    calibration = Calibration("a", {n: CameraCalibration(np.eye(4)) for n in "ab"})
    image = np.zeros((1, 1), np.uint16)
    frames = [
        DepthFrame(name, 0, time, image) for name, time in (("a", 1), ("b", 2), ("a", 3), ("a", 5), ("b", 6))
    ]
    sets = list(frame_sets(frames, calibration, 2))
    assert [{n: f.device_time_ns for n, f in s.items()} for s in sets] == [
        {"a": 1, "b": 2},
        {"a": 3},
        {"a": 5, "b": 6},
    ]


def test_skeleton_frames_of_points_and_of_cameras(scene):
    cameras, placed, sets, truth = scene
    calibration = Calibration("x", {name: CameraCalibration(T) for name, T in placed.items()})
    images = [image for s in sets[:3] for image in s.values()]
    frame, performer = list(from_points(images, cameras, calibration))[-1]
    ((name, T),) = placed.items()
    assert frame.camera == POINTS and 1.4 < performer.height_m < 2.1
    assert np.linalg.norm(frame.positions + T[:3, 3] - truth[2], axis=1)[LIMBS].mean() < 0.06
    assert [f.camera for f in per_camera(images, cameras)] == [name] * 3


def test_a_recorded_t_pose(test_data):
    folder = test_data / PUNCHES
    cameras, placed, sets = recorded(folder, ("camera_0", "camera_1", "camera_2"), 20)
    skeletons = followed(Tracker(cameras, placed), sets)
    truth = truth_at(folder, [s.time_ns for s in skeletons])
    assert np.linalg.norm(skeletons[-1].positions[LIMBS] - truth[-1], axis=1).mean() < 0.045


@pytest.mark.long
@pytest.mark.parametrize(
    ("names", "most"), [(("camera_0", "camera_1", "camera_2"), 0.042), (("camera_1",), 0.055)]
)
def test_recorded_punches(test_data, names, most):
    folder = test_data / PUNCHES
    cameras, placed, sets = recorded(folder, names, 225)
    skeletons = followed(Tracker(cameras, placed), sets)
    truth = truth_at(folder, [s.time_ns for s in skeletons])
    errors = np.linalg.norm(np.stack([s.positions[LIMBS] for s in skeletons]) - truth, axis=2)
    assert errors[75:].mean() < most
    far = errors > 0.15
    assert not any((far[k : k + 10].all(axis=0)).any() for k in range(len(far) - 10))
