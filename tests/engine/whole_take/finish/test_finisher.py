"""Finishing the whole take at once is smoother and nearer than live, holds feet, and hides its windows."""

from dataclasses import replace

import numpy as np
import pytest

from studio.engine.base.errors import SettingsError
from studio.engine.calibration.calibrate import calibrate
from studio.engine.metrics.evaluate import evaluate
from studio.engine.metrics.reference.reference import read_reference
from studio.engine.model.human.ranges import dofs_of, range_rad
from studio.engine.model.joints import INDEX, OUTPUT_INDEX
from studio.engine.model.settings.settings import parse_settings
from studio.engine.whole_take import finisher
from studio.engine.whole_take.take import LIVE_SHARE, solve_frames
from studio.simulator.simulate import simulate_take
from studio.take.raw.frames import camera_frames
from tests.refused import refused
from tests.simulator.short_demo import short_demo

START_S = 33.5
END_S = 50.0


@pytest.fixture(scope="module")
def take(tmp_path_factory):
    """Frames of two cameras that watch the embedded performer walk, its calibration, and the truth."""
    path = tmp_path_factory.mktemp("finish") / "take"
    with short_demo(END_S - 33.0):
        simulate_take("demo", path, cameras=2, seed=9)
    frames = camera_frames(path / "raw.mcap")
    calibration = calibrate(frames, until_s=33.0)
    some = [f for camera in frames.values() for f in camera if START_S * 1e9 < f.device_time_ns < END_S * 1e9]
    return some, calibration, read_reference(path.with_name("take.truth.csv"))


@pytest.fixture(scope="module")
def solves(take):
    frames, calibration, _ = take
    return {name: solve_frames(frames, calibration, parse_settings(name)) for name in ("studio", "finish")}


def test_it_is_nearer_and_smoother_than_live_and_holds_feet(take, solves):
    live, finished = (evaluate(solves[name], take[2]) for name in ("studio", "finish"))
    assert finished["mpjpe_mm"] < live["mpjpe_mm"] + 0.5
    assert finished["acceleration_error_m_s2"] < 0.85 * live["acceleration_error_m_s2"]
    assert finished["foot_slide_cm_s"] < finished["reference_foot_slide_cm_s"] + 1.5
    assert abs(finished["latency_ms"]) < 6.0
    assert finished["bone_length_sd_mm"] < 1e-6


def test_times_are_those_of_the_live_solve_and_the_pose_is_human(solves):
    live, finished = solves["studio"], solves["finish"]
    assert np.array_equal(live.time_s, finished.time_s)
    assert np.linalg.norm(live.positions_m - finished.positions_m, axis=2).max() < 0.35
    feet = finished.positions_m[:, [OUTPUT_INDEX["LeftToeBase"], OUTPUT_INDEX["RightToeBase"]], 2]
    assert feet.min() > 0.0
    knee = range_rad(dofs_of("LeftLeg")[0], 1.0)
    q = np.abs(
        (
            finished.rotations_wxyz[:, OUTPUT_INDEX["LeftLeg"]]
            * finished.rotations_wxyz[:, OUTPUT_INDEX["LeftUpLeg"]]
        ).sum(axis=1)
    )
    assert (2 * np.arccos(np.clip(q, 0, 1))).max() < knee[1] + np.radians(0.1)


@pytest.mark.parametrize("window", [300, *(pytest.param(n, marks=pytest.mark.long) for n in (450, 1000))])
def test_windows_do_not_show(take, solves, monkeypatch, window):
    monkeypatch.setattr(finisher, "WINDOW", window)
    other = solve_frames(take[0], take[1], parse_settings("finish"))
    assert np.array_equal(other.time_s, solves["finish"].time_s)
    away = np.linalg.norm(other.positions_m - solves["finish"].positions_m, axis=2)
    assert away.max() < 1e-3, f"{1e3 * away.mean():.2f} mm, worst {1e3 * away.max():.1f} mm"


def test_equal_input_gives_equal_bits(take):
    frames, told = take[0][:200], []
    settings = parse_settings("finish")
    a, b = (solve_frames(frames, take[1], settings, progress=callback) for callback in (None, told.append))
    assert told == sorted(told) and told[-1] == 1.0
    assert len([share for share in told if LIVE_SHARE < share < 1.0]) > 5
    assert np.array_equal(a.positions_m, b.positions_m) and np.array_equal(a.rotations_wxyz, b.rotations_wxyz)


def test_a_gap_and_a_few_frames_are_no_problem(take):
    frames, calibration, _ = take
    begin = min(f.device_time_ns for f in frames)
    parts = [
        f for f in frames if not 2e9 < f.device_time_ns - begin < 5e9 and f.device_time_ns - begin < 5.15e9
    ]
    poses = solve_frames(parts, calibration, parse_settings("finish"))
    assert np.diff(poses.time_s).max() > 2.0
    assert np.isfinite(poses.positions_m).all()


def test_there_must_be_a_solve_to_refine(take):
    with refused(SettingsError, "settings.finish_needs_pose"):
        solve_frames(take[0][:10], take[1], parse_settings("raw", ["finish=on"]))


def test_a_joint_out_of_reach_is_not_followed(take):
    """The cameras see a wrist 0.2 m too high; at reach 0 the arm decides its place."""
    frames, calibration, _ = take
    wrist = INDEX["left_wrist"]
    wrong = []
    for frame in frames[:120]:
        positions = frame.positions.copy()
        positions[wrist] += calibration.cameras[frame.camera].T_stage_camera[2, :3] * 0.2
        wrong.append(replace(frame, positions=positions))
    heights = []
    for reach in (1, 0):
        settings = parse_settings(
            "finish", [f"effectors.left_wrist.reach={reach}", "effectors.left_hand.reach=0"]
        )
        poses = solve_frames(wrong, calibration, settings)
        heights.append(poses.positions_m[:, OUTPUT_INDEX["LeftHand"], 2].mean())
    assert heights[0] > heights[1] + 0.05
