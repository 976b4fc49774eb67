"""A whole take through the pipeline."""

from dataclasses import replace

import numpy as np
import pytest

from studio.engine.base.errors import TakeError
from studio.engine.model.frames import ClockModel
from studio.engine.model.joints import JOINT_COUNT, OUTPUT_JOINTS
from studio.engine.model.settings.settings import parse_settings
from studio.engine.whole_take.collect import collect_poses
from studio.engine.whole_take.take import solve_frames
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
