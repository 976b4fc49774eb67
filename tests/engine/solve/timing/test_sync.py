"""Synchronisation: clocks, interpolation, gaps, and the transform to the stage frame."""

from dataclasses import replace

import numpy as np
import pytest

from studio.engine.base.geometry import quaternions
from studio.engine.calibration.cameras.noise import unbiased
from studio.engine.model.calibration import CameraCalibration
from studio.engine.model.cameras.lens import usual_lens
from studio.engine.model.frames import CameraFrame, ClockModel, HandSeen, PictureJoints
from studio.engine.model.human.face import LANDMARKS as FACE_LANDMARKS
from studio.engine.model.joints import INDEX, JOINT_COUNT
from studio.engine.solve.timing.sync import HISTORY, MAX_AGE_NS, MAX_GAP_NS, Synchroniser
from tests.engine.walkers import SECOND, arms_swinging, camera_at, camera_frame, recorded, stage

MS = 1_000_000


def plain(time_ns, value, *, camera="a", confidence=0.9, **more):
    """A frame whose joints are all at (value, value, value) in the camera frame."""
    positions = np.full((JOINT_COUNT, 3), float(value))
    return CameraFrame(camera, 0, time_ns, positions, np.full(JOINT_COUNT, confidence), **more)


def one_camera(**changes):
    return Synchroniser({"a": CameraCalibration(np.eye(4), **changes)})


def test_frames_are_interpolated_between():
    sync = one_camera()
    sync.add(plain(1000 * MS, 1.0, confidence=0.9))
    sync.add(plain(1040 * MS, 2.0, confidence=0.5))
    found = sync.frame_set(1010 * MS)
    assert found.positions[0] == pytest.approx(1.25)
    assert found.confidence[0] == pytest.approx(0.5)
    assert sync.frame_set(1000 * MS).positions[0] == pytest.approx(1.0)
    assert sync.frame_set(1040 * MS).positions[0] == pytest.approx(2.0)


def test_across_a_gap_the_nearest_frame_stands_or_none():
    sync = one_camera()
    sync.add(plain(1000 * MS, 1.0))
    sync.add(plain(1000 * MS + 2 * MAX_GAP_NS, 2.0))
    assert sync.frame_set(1030 * MS).positions[0] == pytest.approx(1.0)
    assert np.isnan(sync.frame_set(1000 * MS + MAX_GAP_NS).positions).all()
    assert (sync.frame_set(1000 * MS + MAX_GAP_NS).confidence == 0).all()
    assert sync.frame_set(1190 * MS).positions[0] == pytest.approx(2.0)


def test_before_and_after_all_frames_the_nearest_stands_for_a_while():
    sync = one_camera()
    sync.add(plain(1000 * MS, 1.0))
    for off in (-MAX_AGE_NS, MAX_AGE_NS):
        assert sync.frame_set(1000 * MS + off).positions[0] == pytest.approx(1.0)
        assert np.isnan(sync.frame_set(1000 * MS + off + int(np.sign(off)) * MS).positions).all()


@pytest.mark.parametrize("seen_first", [True, False])
def test_a_joint_seen_in_one_of_two_frames_is_there_near_that_frame_only(seen_first):
    sync = one_camera()
    first, second = plain(1000 * MS, 1.0), plain(1040 * MS, 2.0)
    hidden = second if seen_first else first
    hidden.positions[INDEX["head"]] = np.nan
    hidden.confidence[INDEX["head"]] = 0.0
    sync.add(first)
    sync.add(second)
    near, far = (1008, 1032) if seen_first else (1032, 1008)
    found = sync.frame_set(near * MS)
    assert found.positions[0, INDEX["head"]] == pytest.approx(1.0 if seen_first else 2.0)
    assert found.confidence[0, INDEX["head"]] == pytest.approx(0.9)
    found = sync.frame_set(far * MS)
    assert np.isnan(found.positions[0, INDEX["head"]]).all() and found.confidence[0, INDEX["head"]] == 0
    assert np.isfinite(found.positions[0, INDEX["hips"]]).all()


def test_clocks_with_offset_and_drift_bring_cameras_together():
    truth = ClockModel(offset_ns=-3 * SECOND, drift_ppm=80.0, reference_ns=4 * SECOND)
    calibration = stage(0.0, 60.0)
    late = replace(calibration.cameras["b"], clock=truth)
    sync = Synchroniser(calibration.cameras | {"b": late})
    for frame in recorded(calibration, arms_swinging, 1.0):
        if frame.camera == "b":
            stage_ns = frame.device_time_ns
            device = round((stage_ns + 3 * SECOND + 80e-6 * 4 * SECOND) / (1 + 80e-6))
            frame = replace(frame, device_time_ns=device)
        sync.add(frame)
    found = sync.frame_set(round(1.51 * SECOND))
    assert np.abs(found.positions[0] - found.positions[1]).max() < 1e-5
    assert np.abs(found.positions[0] - arms_swinging(1.51)).max() < 2e-3
    newest = sync.newest_stage_ns()
    assert abs(newest["a"] - newest["b"]) < 100


def test_another_clock_counts_from_then_on():
    sync = one_camera()
    sync.set_clock("nobody", ClockModel(offset_ns=1))
    sync.set_clock("a", ClockModel(offset_ns=500 * MS))
    sync.add(plain(1000 * MS, 1.0))
    assert sync.newest_stage_ns() == {"a": 1500 * MS}


def test_time_that_goes_back_a_little_is_dropped_and_a_lot_starts_anew():
    sync = one_camera()
    sync.add(plain(5000 * MS, 1.0))
    sync.add(plain(4990 * MS, 9.0))
    sync.add(plain(5000 * MS, 9.0))
    assert sync.newest_stage_ns() == {"a": 5000 * MS}
    assert sync.frame_set(5000 * MS).positions[0] == pytest.approx(1.0)
    sync.add(plain(1000 * MS, 3.0))
    sync.add(plain(1033 * MS, 4.0))
    assert sync.newest_stage_ns() == {"a": 1033 * MS}
    assert sync.frame_set(1000 * MS).positions[0] == pytest.approx(3.0)
    assert np.isnan(sync.frame_set(5000 * MS).positions).all()


def test_one_frame_far_ahead_is_dropped_and_followed_once_another_comes():
    sync = one_camera()
    for time_ms in (1000, 1033, 3_600_000, 1066):
        sync.add(plain(time_ms * MS, time_ms / 1000))
    assert sync.newest_stage_ns() == {"a": 1066 * MS}
    assert sync.frame_set(1066 * MS).positions[0] == pytest.approx(1.066)
    sync.add(plain(20_000 * MS, 1.0))
    assert sync.newest_stage_ns() == {"a": 1066 * MS}
    sync.add(plain(20_033 * MS, 2.0))
    assert sync.newest_stage_ns() == {"a": 20_033 * MS}


def test_only_so_many_frames_are_kept():
    sync = one_camera()
    for k in range(HISTORY + 10):
        sync.add(plain(1000 * MS + k * 33 * MS, k))
    assert np.isnan(sync.frame_set(1000 * MS).positions).all()
    assert np.isfinite(sync.frame_set(1000 * MS + 20 * 33 * MS).positions).all()


def test_joints_come_to_the_stage_frame_by_each_cameras_transform():
    calibration = stage(-35.0, 90.0, 180.0)
    sync = Synchroniser(calibration.cameras)
    joints = arms_swinging(0.3)
    for name in calibration.cameras:
        sync.add(camera_frame(calibration, name, 1.0, joints))
    found = sync.frame_set(SECOND)
    assert np.abs(found.positions - joints).max() < 1e-9
    assert found.cameras == ("a", "b", "c")
    assert found.camera_positions == pytest.approx(
        np.array([camera_at(a)[:3, 3] for a in (-35.0, 90.0, 180.0)])
    )


def test_the_depth_bias_is_undone_along_the_ray():
    T = camera_at(20.0)
    sync = Synchroniser({"a": CameraCalibration(T, depth_bias_m=0.03)})
    calibration = replace(stage(0.0), cameras={"a": CameraCalibration(T)})
    joints = arms_swinging(0.0)
    frame = camera_frame(calibration, "a", 1.0, joints)
    distance = np.linalg.norm(frame.positions, axis=1, keepdims=True)
    sync.add(replace(frame, positions=frame.positions * (1 - 0.03 / distance)))
    assert np.abs(sync.frame_set(SECOND).positions[0] - joints).max() < 5e-4
    assert np.isfinite(unbiased(np.zeros((2, 3)), 0.03)).all(), "a joint in the lens"


def test_a_camera_without_a_frame_near_is_unseen_and_strangers_are_ignored():
    calibration = stage(0.0, 60.0)
    sync = Synchroniser(calibration.cameras)
    sync.add(camera_frame(calibration, "a", 1.0, arms_swinging(1.0)))
    sync.add(plain(SECOND, 1.0, camera="stranger"))
    found = sync.frame_set(SECOND)
    assert np.isfinite(found.positions[0]).all() and np.isnan(found.positions[1]).all()
    assert set(sync.newest_stage_ns()) == {"a"}


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf, 3e38, 1e9])
def test_a_joint_with_a_number_that_cannot_be_is_wholly_unseen(bad):
    sync = one_camera()
    for time_ms in (1000, 1033):
        frame = plain(time_ms * MS, 1.0)
        frame.positions[3, 1] = bad
        sync.add(frame)
    for at in (1000, 1010, 1040):
        found = sync.frame_set(at * MS)
        assert np.isnan(found.positions[0, 3]).all() and found.confidence[0, 3] == 0
        assert np.isfinite(np.delete(found.positions[0], 3, axis=0)).all()


def test_faces_of_pictures_are_rays_at_the_instant():
    lens = usual_lens(640, 480)
    cameras = {name: CameraCalibration(np.eye(4), lens=lens) for name in ("a", "b")}
    sync = Synchroniser(cameras)
    unseen = np.full((JOINT_COUNT, 3), np.nan)
    for time_ns, column in ((SECOND, 300.0), (SECOND + 40 * MS, 340.0)):
        face = np.tile([column, lens.cy], (FACE_LANDMARKS, 1))
        face[4] = np.nan
        picture = PictureJoints(640, 480, unseen[:, :2], unseen, face=face)
        sync.add(CameraFrame("a", 0, time_ns, unseen, np.zeros(JOINT_COUNT), picture=picture))
    found = sync.frame_set(SECOND + 20 * MS)
    assert found.hand_rays is None and found.face_rays is not None
    assert found.face_rays.shape == (2, FACE_LANDMARKS, 3) and np.isnan(found.face_rays[1]).all()
    x, y, z = found.face_rays[0, 0]
    assert x / z == pytest.approx((320.0 - lens.cx) / lens.fx, abs=1e-3) and y == pytest.approx(0.0, abs=1e-9)
    assert np.isnan(found.face_rays[0, 4]).all()
    assert sync.frame_set(3 * SECOND).face_rays is None


def test_hands_and_head_come_with_the_newest_frame_in_stage_axes():
    T = camera_at(90.0)
    sync = Synchroniser({"a": CameraCalibration(T)})
    hand = HandSeen("left", "shape", 0.8)
    in_camera = T[:3, :3].T  # a head with stage axes, as the camera sees it
    w, x, y, z = (float(v) for v in quaternions(in_camera))
    sync.add(plain(SECOND, 1.0, hands=(hand,), head_wxyz=(w, x, y, z)))
    found = sync.frame_set(SECOND)
    assert found.hands == (hand,)
    assert np.abs(found.head_wxyz) == pytest.approx([1, 0, 0, 0], abs=1e-9)
    assert sync.frame_set(2 * SECOND).hands == () and sync.frame_set(2 * SECOND).head_wxyz is None


@pytest.mark.parametrize("head", [(0, 0, 0, 0), (np.nan, 0, 0, 1), (np.inf, 1, 0, 0), (1e300, 1e300, 0, 0)])
def test_a_head_that_is_no_rotation_is_not_measured(head):
    sync = one_camera()
    sync.add(plain(SECOND, 1.0, head_wxyz=head))
    assert sync.frame_set(SECOND).head_wxyz is None
