"""A whole take through the pipeline."""

from dataclasses import replace

import numpy as np
import pytest

from studio.engine.base.errors import TakeError
from studio.engine.edits.edit import PinEdit
from studio.engine.edits.pins import Pins
from studio.engine.model.frames import ClockModel
from studio.engine.model.joints import JOINT_COUNT, OUTPUT_INDEX, OUTPUT_JOINTS
from studio.engine.model.settings.settings import PRESETS, parse_settings
from studio.engine.solve.stream import Stream
from studio.engine.whole_take.collect import collect_poses
from studio.engine.whole_take.edited import AROUND_S, Edited
from studio.engine.whole_take.take import TakeSolve, solve_frames
from tests.engine.walkers import SECOND, arms_swinging, recorded, stage
from tests.refused import refused

SETTINGS = parse_settings("studio")


@pytest.fixture(scope="module")
def frames():
    return list(recorded(stage(-35.0, 35.0), arms_swinging, 2.0, noise_m=0.005))


def test_poses_come_at_the_output_rate_in_time_order(frames):
    poses = solve_frames(frames, stage(-35.0, 35.0), SETTINGS)
    assert poses.joint_names == OUTPUT_JOINTS
    assert poses.frames_per_second == pytest.approx(60.0, rel=1e-3)
    assert np.diff(poses.time_s) == pytest.approx(1 / 60, abs=1e-6)
    assert poses.time_s[0] == pytest.approx(1.0, abs=0.1) and poses.time_s[-1] > 2.9
    assert not poses.positions_m[0] == pytest.approx(poses.positions_m[-1])


@pytest.mark.parametrize("preset", ["studio", "finish"])
def test_an_edit_moves_nothing_that_is_not_near_it(preset):
    calibration, settings = stage(-35.0, 35.0), parse_settings(preset)
    frames = list(recorded(calibration, arms_swinging, 3.5, noise_m=0.005))
    own = solve_frames(frames, calibration, settings)
    at, wrist = len(own.time_s) // 2, OUTPUT_INDEX["LeftHand"]
    place_m = own.positions_m[at, wrist] + [0.0, 0.05, 0.05]
    at_s = float(own.time_s[at])
    pin = PinEdit(id="a", start_s=at_s, end_s=at_s, joint="left_wrist", place_m=tuple(place_m.tolist()))
    pins = Pins([pin], calibration.performer)
    edited = Edited(pins, pins.spans_s, frames)
    solve = TakeSolve(frames, calibration, settings, edited=edited)
    solve.first()
    poses = solve.poses()
    assert np.linalg.norm(poses.positions_m[at, wrist] - place_m) < 0.03
    outside = np.abs(poses.time_s - at_s) > AROUND_S + 1e-6
    assert outside.sum() > 100
    np.testing.assert_allclose(poses.positions_m[outside], own.positions_m[outside], rtol=0.0, atol=1e-12)
    steps = np.linalg.norm(np.diff(poses.positions_m - own.positions_m, axis=0), axis=2)
    assert steps[np.abs(poses.time_s[1:] - at_s) > 0.3].max() < 0.005  # the transition has no jump


@pytest.mark.parametrize("preset", PRESETS)
def test_a_stream_goes_on_from_the_state_of_another(frames, preset):
    stream = Stream(stage(-35.0, 35.0), parse_settings(preset))
    ordered = sorted(frames, key=lambda frame: frame.device_time_ns)
    for frame in ordered[: len(frames) // 2]:
        stream.add(frame)
    other = stream.with_pins(None)
    for frame in ordered[len(frames) // 2 :]:
        for one, two in zip(stream.add(frame), other.add(frame), strict=True):
            assert np.array_equal(one.positions_m, two.positions_m)


def test_the_order_of_the_frames_does_not_matter(frames):
    a = solve_frames(frames, stage(-35.0, 35.0), SETTINGS)
    shuffled = [frames[i] for i in np.random.default_rng(1).permutation(len(frames))]
    b = solve_frames(shuffled, stage(-35.0, 35.0), SETTINGS)
    assert a.positions_m.tobytes() == b.positions_m.tobytes()


def test_nothing_before_the_start_is_kept(frames):
    poses = solve_frames(frames, stage(-35.0, 35.0), SETTINGS, start_s=2.2)
    assert poses.time_s[0] == pytest.approx(2.2, abs=0.02)
    whole = solve_frames(frames, stage(-35.0, 35.0), SETTINGS)
    assert poses.positions_m[-1] == pytest.approx(whole.positions_m[-1], abs=0.01)


def test_progress_goes_up_to_one(frames):
    told = []
    solve_frames(frames, stage(-35.0, 35.0), SETTINGS, progress=told.append)
    assert told == sorted(told) and told[-1] == 1.0 and 0 <= told[0] < 0.1


def test_it_needs_frames_that_show_somebody():
    calibration = stage(0.0)
    with refused(TakeError, "take.nobody_seen"):
        solve_frames([], calibration, SETTINGS)
    nobody = recorded(calibration, lambda t: np.full((JOINT_COUNT, 3), np.nan), 0.3)
    with refused(TakeError, "take.nobody_seen"):
        solve_frames(nobody, calibration, SETTINGS)
    with pytest.raises(TakeError):
        collect_poses([])


def test_each_camera_is_on_its_own_clock(frames):
    calibration = stage(-35.0, 35.0)
    late = replace(calibration.cameras["b"], clock=ClockModel(offset_ns=-SECOND))
    other = replace(calibration, cameras=calibration.cameras | {"b": late})
    moved = [replace(f, device_time_ns=f.device_time_ns + SECOND) if f.camera == "b" else f for f in frames]
    a, b = solve_frames(frames, calibration, SETTINGS), solve_frames(moved, other, SETTINGS)
    assert a.positions_m.tobytes() == b.positions_m.tobytes()
