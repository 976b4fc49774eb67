"""The steps of a calibration, one by one."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from studio.engine.base.geometry import make_transform, transform_points
from studio.engine.calibration.cameras import refine as refine_module
from studio.engine.calibration.cameras.merge import Walk
from studio.engine.calibration.cameras.pairs import LocalClock, Track, grid, make_track, sample
from studio.engine.calibration.cameras.rigid import fit_robust, middle_points, mirrored
from studio.engine.calibration.cameras.swaps import find_swaps
from studio.engine.calibration.cameras.time_offset import find_shift
from studio.engine.calibration.performer.floor import Floor, find_floor
from studio.engine.calibration.performer.stage import stage_from_walk
from studio.engine.calibration.performer.tpose import find_tpose
from studio.engine.calibration.quality.residuals import disagreement, even_blocks
from studio.engine.model.frames import CameraFrame
from studio.engine.model.joints import INDEX, MIRROR
from tests.engine.calibration.synthetic import RIGS, Options, performer, record

TRANSFORMS = st.builds(
    lambda r, t: make_transform(Rotation.from_rotvec(r).as_matrix(), np.array(t)),
    st.lists(st.floats(-1.7, 1.7), min_size=3, max_size=3),
    st.lists(st.floats(-4, 4), min_size=3, max_size=3),
)


def quiet_track(seed=0, **options):
    choice = {"noise": 0.0, "spikes": False, "dropouts": False, "swaps": False, "hidden": False, **options}
    return make_track(record(seed, RIGS[1], Options(**choice))[0]["camera_0"])


def walk_of(joints, times):
    return Walk(times, joints[None], np.ones((1, *joints.shape[:2])), joints)


@given(TRANSFORMS, st.integers(0, 2**31))
@settings(max_examples=30, deadline=None)
def test_robust_fit_finds_any_transform_through_outliers(T, seed):
    rng = np.random.default_rng(seed)
    source = rng.normal(0, [0.7, 0.5, 0.7], (400, 3))
    target = transform_points(T, source) + rng.normal(0, 0.01, source.shape)
    target[:80] += rng.normal(0, 0.5, (80, 3))
    found = fit_robust(source, target).T
    assert np.abs(transform_points(found, source) - transform_points(T, source)).max() < 0.008


@given(TRANSFORMS)
@settings(max_examples=20, deadline=None)
def test_a_mirror_image_is_told_from_a_turn(T):
    rng = np.random.default_rng(1)
    source = rng.normal(0, [0.7, 0.4, 0.7], (300, 3))
    turned = transform_points(T, source)
    assert not mirrored(source, turned, fit_robust(source, turned))
    flipped = transform_points(T, source * [-1, 1, 1])
    assert mirrored(source, flipped, fit_robust(source, flipped))


def test_middle_points_ignore_left_and_right():
    joints = performer(np.array([7.0]))
    np.testing.assert_allclose(middle_points(joints), middle_points(joints[:, MIRROR]))


def test_no_interpolation_across_a_gap():
    track = quiet_track()
    keep = (track.times_s < 10.0) | (track.times_s > 10.2)
    cut = Track(track.epoch_ns, track.times_s[keep], track.positions[keep], track.confidence[keep])
    positions, confidence = sample(cut, np.array([9.5, 10.1, 10.5, -1.0, 99.0]))
    assert np.isfinite(positions[:, 0, 0]).tolist() == [True, False, True, False, False]
    assert (confidence[[1, 3, 4]] == 0).all()
    between, _ = sample(track, np.array([10.1]))
    around, _ = sample(track, np.array([10.08, 10.12]))
    assert np.linalg.norm(between - around.mean(axis=0), axis=2).max() < 0.01


def test_frames_that_repeat_or_step_back_are_left_out():
    def frame(i, t):
        return CameraFrame("c", i, t, np.zeros((21, 3)), np.ones(21))

    track = make_track([frame(0, 100), frame(1, 100), frame(2, 300), frame(3, 200), frame(4, 400)])
    np.testing.assert_allclose(track.times_s * 1e9, [0, 200, 300])


@given(st.floats(-0.2, 0.2), st.floats(-1e-3, 1e-3), st.floats(0, 100))
def test_local_clock_is_the_inverse_of_its_model(offset_s, drift, middle_s):
    clock = LocalClock(offset_s, drift, middle_s)
    reference = Track(5_000, np.array([0.0, 200.0]), np.zeros((2, 21, 3)), np.ones((2, 21)))
    track = Track(77_000, np.array([0.0, 200.0]), np.zeros((2, 21, 3)), np.ones((2, 21)))
    at = np.array([12.5, 90.0])
    device_s = clock.device_s(at) + track.epoch_ns * 1e-9
    model = clock.model(track, reference)
    np.testing.assert_allclose(model.stage_s(device_s), at + reference.epoch_ns * 1e-9, atol=2e-6)


@pytest.mark.parametrize("shift_s", [-0.15, 0.04, 0.15])
def test_shift_is_found_from_the_speeds(shift_s):
    frames, _ = record(31, RIGS[2], Options(max_offset_s=0.0))
    one, two = make_track(frames["camera_0"]), make_track(frames["camera_1"])
    two = Track(two.epoch_ns, two.times_s, two.positions, two.confidence)
    ahead_s = (two.epoch_ns - one.epoch_ns) * 1e-9
    shift = find_shift(two, one, near_s=ahead_s + shift_s)
    assert shift.found
    assert shift.offset_s == pytest.approx(ahead_s, abs=0.03)


def test_slow_motion_gives_no_shift_but_a_reason():
    still = {"noise": 0.0, "spikes": False, "dropouts": False, "hidden": False, "duration_s": 12.0}
    frames, _ = record(32, RIGS[2], Options(**still), walking=False)
    one, two = make_track(frames["camera_0"]), make_track(frames["camera_1"])
    shift = find_shift(two.until(2.9), one.until(2.9), near_s=0.0)
    assert not shift.found
    assert shift.offset_s == 0
    assert shift.reason


def test_swapped_frames_are_found():
    joints = performer(np.linspace(0, 30, 900))
    rng = np.random.default_rng(3)
    views = np.stack([joints + rng.normal(0, 0.03, joints.shape) for _ in range(3)])
    swapped = np.zeros((3, 900), dtype=bool)
    swapped[1, 100:190], swapped[2, 150:400] = True, True
    for camera in (1, 2):
        views[camera, swapped[camera]] = views[camera, swapped[camera]][:, MIRROR]
    found = find_swaps(views)
    assert (found == swapped).mean() > 0.99
    assert not found[0].any()


def test_swaps_of_the_first_camera_show_in_all_others():
    joints = performer(np.linspace(0, 10, 300))
    views = np.stack([joints] * 3)
    views[0, 50:100] = views[0, 50:100][:, MIRROR]
    found = find_swaps(views)
    assert found[1:, 50:100].all()
    assert not found[:, 100:].any()


def test_derivatives_are_those_of_finite_differences():
    rng = np.random.default_rng(0)
    p, v, since = rng.normal(size=(5, 3)), rng.normal(size=(5, 3)), rng.normal(size=5)
    J = refine_module._jacobian(p, v, since)
    step = 1e-6
    for k in range(3):
        turn = Rotation.from_rotvec(np.eye(3)[k] * step).as_matrix()
        np.testing.assert_allclose(J[:, :, k], (p @ turn.T - p) / step, atol=1e-5)
        np.testing.assert_allclose(J[:, :, 3 + k], np.tile(np.eye(3)[k], (5, 1)))
    np.testing.assert_allclose(J[:, :, 6], -v)  # a clock further ahead shows the joint as it was before
    np.testing.assert_allclose(J[:, :, 7], -v * since[:, None])


@given(TRANSFORMS)
@settings(max_examples=15, deadline=None)
def test_floor_is_found_in_any_frame(T):
    times = grid(quiet_track())
    walk = walk_of(performer(times), times).moved(T)
    floor = find_floor(walk, 1.70)
    up = T[:3, 2]
    assert np.degrees(np.arccos(np.clip(floor.up @ up, -1, 1))) < 1.0
    assert floor.height_m == pytest.approx(floor.up @ T[:3, 3], abs=0.03)


@given(TRANSFORMS)
@settings(max_examples=20, deadline=None)
def test_stage_frame_puts_what_it_is_given_in_place(T):
    floor = Floor(T[:3, 2], float(T[:3, 2] @ T[:3, 3]))
    hips, forward = transform_points(T, np.array([0.3, 0.2, 0.9])), -T[:3, 1] + 0.3 * T[:3, 2]
    stage = stage_from_walk(floor, hips, forward)
    np.testing.assert_allclose(transform_points(stage, hips), [0, 0, 0.9], atol=1e-9)
    np.testing.assert_allclose(transform_points(stage @ T, np.array([0.3, -0.8, 0.0])), [0, -1, 0], atol=1e-9)


def test_tpose_is_found_where_it_is_held():
    times = np.arange(0, 20, 1 / 30)
    joints = performer(np.where(times > 12, times - 12, times + 3.5))
    hold = find_tpose(walk_of(joints, times), np.array([0.0, 0.0, 1.0]))
    assert times[hold.first] == pytest.approx(12.0, abs=0.6)
    assert times[hold.end - 1] == pytest.approx(15.0, abs=0.6)
    walking = performer(times + 4.0)
    assert find_tpose(walk_of(walking, times), np.array([0.0, 0.0, 1.0])) is None


def test_a_bent_arm_is_no_tpose():
    times = np.arange(0, 3, 1 / 30)
    joints = performer(times)
    joints[:, [INDEX["left_wrist"], INDEX["left_hand"]]] += [-0.2, -0.2, 0.0]
    assert find_tpose(walk_of(joints, times), np.array([0.0, 0.0, 1.0])) is None


def test_disagreement_of_a_camera_moved_on_the_stage():
    T_stage = RIGS[1][0]
    moved = make_transform(np.eye(3), np.array([0.03, 0.0, 0.04]))
    hips = np.array([[-1.0, -1.0, 0.9], [1.0, 1.0, 0.9], [np.nan, 0.0, 0.0]])
    metres, degrees = disagreement(np.eye(4), moved, T_stage, hips)
    assert metres == pytest.approx(0.05)
    assert degrees == pytest.approx(0.0, abs=1e-4)
    turned = make_transform(Rotation.from_euler("y", 2, degrees=True).as_matrix(), np.zeros(3))
    assert disagreement(np.eye(4), turned, T_stage, hips)[1] == pytest.approx(2.0)


def test_blocks_alternate_every_five_seconds():
    assert even_blocks(np.array([0.0, 4.9, 5.0, 9.9, 10.0, 15.1])).tolist() == [
        True,
        True,
        False,
        False,
        True,
        False,
    ]
