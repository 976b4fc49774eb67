"""Bad input, live and finished: the pose stays finite and human, and joints that it does not follow are reported."""

from dataclasses import replace

import numpy as np
import pytest

from studio.engine.base.geometry import matrices
from studio.engine.model.frames import CameraFrame
from studio.engine.model.human.angles import configuration_of
from studio.engine.model.human.humanoid import build_humanoid
from studio.engine.model.human.skeleton import Skeleton
from studio.engine.model.joints import (
    CANONICAL,
    INDEX,
    JOINT_COUNT,
    MEASURED_JOINTS,
    OUTPUT_INDEX,
    OUTPUT_OF_CANONICAL_INDEX,
)
from studio.engine.model.settings.settings import parse_settings
from studio.engine.whole_take.residuals import TOLD_S, SolveResiduals
from studio.engine.whole_take.take import solve_frames
from tests.engine.walkers import (
    SECOND,
    arms_swinging,
    camera_frame,
    humanoid,
    performer,
    recorded,
    site_positions,
    stage,
)

STAGE = stage(-35.0, 35.0)
WAYS = ("studio", "finish")
MEASURED = [INDEX[name] for name in MEASURED_JOINTS]
ASIDE = np.array([1.3, 0.4, 0.0])
START_S, SECONDS = 1.0, 1.4


def long(*values):
    """Values of a test's parameters for the long form only; the short form has others."""
    return pytest.param(*values, marks=pytest.mark.long)


SIZES = [(0.9, "studio"), (2.3, "finish"), long(0.9, "finish"), long(2.3, "studio")]


def seen(change, seconds=SECONDS, noise_m=0.005, calibration=STAGE):
    """Frames of all cameras, each changed by `change(time_s, camera, positions)`, which may return None."""
    frames = []
    for frame in recorded(calibration, arms_swinging, seconds, noise_m=noise_m):
        positions = change(frame.device_time_ns / SECOND, frame.camera, frame.positions.copy())
        if positions is not None:
            frames.append(replace(frame, positions=positions))
    return frames


def solved(frames, way, calibration=STAGE):
    """Poses, and the report of joints that were not followed."""
    residuals = SolveResiduals()
    return solve_frames(frames, calibration, parse_settings(way), residuals=residuals), residuals


def assert_human(poses, body=None):
    """Check for finite values, constant bone lengths, and every hinge within its range."""
    body = body or performer()
    skeleton = Skeleton.of(body)
    full = build_humanoid(skeleton)
    low, high = full.range_rad.T
    lengths = np.linalg.norm(skeleton.offsets_m, axis=1)[1:]
    assert np.isfinite(poses.positions_m).all() and np.isfinite(poses.rotations_wxyz).all()
    assert np.isfinite(poses.confidence).all()
    assert np.abs(poses.positions_m).max() < 20
    bones = poses.positions_m[:, 1:] - poses.positions_m[:, poses.parents[1:]]
    assert np.abs(np.linalg.norm(bones, axis=2) - lengths).max() < 1e-9
    for positions, rotations in zip(poses.positions_m[::6], poses.rotations_wxyz[::6], strict=True):
        q = configuration_of(full, positions[0], matrices(rotations), limited=False)[7:]
        over = np.maximum(low - q, q - high)
        worst = int(over.argmax())
        assert np.degrees(over[worst]) < 0.1, full.model.joint(worst + 1).name


def error_m(poses, start_s=0.0, joints_at=arms_swinging):
    """Mean error of the measured joints from a given time on [m]."""
    late = poses.time_s >= start_s
    truth = np.array([joints_at(t) for t in poses.time_s[late]])
    found = poses.positions_m[late][:, OUTPUT_OF_CANONICAL_INDEX]
    return float(np.linalg.norm(found - truth, axis=2)[:, MEASURED].mean())


@pytest.mark.parametrize("way", WAYS)
def test_good_input_is_followed(way):
    poses, residuals = solved(seen(lambda _t, _camera, p: p), way)
    assert_human(poses)
    assert residuals.line() == "all joints"
    assert all(joint.largest_mm == 0 for joint in residuals.joints().values())


@pytest.mark.parametrize(
    ("value", "way"),
    [
        (np.nan, "studio"),
        (-np.inf, "finish"),
        (3e38, "finish"),
        *(long(*one) for one in ((np.nan, "finish"), (-np.inf, "studio"), (3e38, "studio"))),
    ],
)
def test_a_joint_that_is_no_number(value, way):
    def broken(_t, _camera, positions):
        positions[INDEX["left_wrist"], 1] = value
        return positions

    poses, residuals = solved(seen(broken), way)
    assert_human(poses)
    assert error_m(poses) < 0.06
    assert residuals.line() == "never saw left_wrist"
    assert residuals.joints()["left_wrist"].unseen_share == 1.0


@pytest.mark.parametrize("way", WAYS)
def test_whole_frames_of_no_numbers(way):
    def broken(time_s, camera, positions):
        positions[:] = np.inf if time_s > 1.7 and camera == "a" else np.nan if time_s > 1.7 else positions
        return positions

    poses, residuals = solved(seen(broken), way)
    assert_human(poses)
    assert "saw nobody" in residuals.line()


def few_joints(count, seed):
    """For the first half all joints are seen, then `count` of them."""
    left = np.random.default_rng(seed).choice(JOINT_COUNT, count, replace=False)

    def fewer(time_s, _camera, positions):
        if time_s > START_S + 0.5 * SECONDS:
            positions[np.setdiff1d(np.arange(JOINT_COUNT), left)] = np.nan
        return positions

    return fewer


@pytest.mark.parametrize(("count", "way"), [(1, "studio"), (1, "finish"), (4, "finish"), (13, "studio")])
def test_joints_missing(count, way):
    poses, _ = solved(seen(few_joints(count, count)), way)
    assert_human(poses)
    assert error_m(poses) < (0.05 if count > 12 else 0.25)


@pytest.mark.long
@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("count", range(1, 21))
def test_any_joints_missing(count, way, seed):
    poses, _ = solved(seen(few_joints(count, 100 * seed + count)), way)
    assert_human(poses)
    assert error_m(poses) < (0.05 if count > 12 else 0.25)


@pytest.mark.parametrize("way", WAYS)
def test_joints_that_were_never_seen_are_told(way):
    def fewer(_t, _camera, positions):
        positions[
            [INDEX[name] for name in ("left_hand", "right_hand", "left_toe", "right_toe", "head", "spine")]
        ] = np.nan
        return positions

    poses, residuals = solved(seen(fewer), way)
    assert_human(poses)
    assert residuals.line() == "never saw spine, head, left_hand, left_toe and 2 more"


@pytest.mark.parametrize("way", WAYS)
def test_time_that_goes_back(way):
    """A camera's clock falls back by half a second, and by ten; frames come twice and in disorder."""
    frames = seen(lambda _t, _camera, p: p)
    for back_s in (0.5, 10.0):
        late = [f for f in frames if f.device_time_ns > 1.7 * SECOND and f.camera == "b"]
        jumped = {id(f): replace(f, device_time_ns=f.device_time_ns - round(back_s * SECOND)) for f in late}
        mixed = [jumped.get(id(f), f) for f in frames]
        mixed += mixed[20:30] + mixed[40:35:-1]
        poses, _ = solved(mixed, way)
        assert_human(poses)
        assert (np.diff(poses.time_s) > 0).all()


@pytest.mark.parametrize("way", WAYS)
def test_a_gap_of_ten_seconds(way):
    def with_gap(time_s, _camera, positions):
        return positions if time_s < 2.0 or time_s > 12.0 else None

    poses, residuals = solved(seen(with_gap, seconds=11.8), way)
    assert_human(poses)
    after = poses.time_s > 12.3
    assert after.any() and error_m(poses, 12.3) < 0.03
    assert residuals.joints()["hips"].largest_mm == 0


def somebody_else(time_s):
    return arms_swinging(time_s + 0.7) + ASIDE


@pytest.mark.parametrize("way", WAYS)
def test_a_second_person_in_one_camera(way):
    """For 0.4 s one of two cameras shows another person: the performer is still followed."""

    def changed(time_s, camera, positions):
        if camera == "b" and 1.6 < time_s < 2.0:
            frame: CameraFrame = camera_frame(STAGE, "b", time_s, somebody_else(time_s))
            return frame.positions
        return positions

    poses, residuals = solved(seen(changed), way)
    assert_human(poses)
    assert error_m(poses) < 0.05
    assert "could not follow" not in residuals.line()


@pytest.mark.parametrize("way", WAYS)
def test_a_second_person_in_all_cameras_by_turns(way):
    """Every tenth of a second, to the end, all cameras swap the performer for another person."""

    def changed(time_s, camera, positions):
        if round(time_s * 30) // 3 % 2:
            return camera_frame(STAGE, camera, time_s, somebody_else(time_s)).positions
        return positions

    poses, residuals = solved(seen(changed), way)
    assert_human(poses)
    assert "jumped to somebody elsewhere" in residuals.line() or "could not follow" in residuals.line()


@pytest.mark.parametrize("way", WAYS)
def test_what_no_human_can_do_is_told(way):
    """A wrist that is held half a metre outside the arm's reach."""

    def pulled(time_s, _camera, positions):
        if time_s > 1.7:
            positions[[INDEX["left_wrist"], INDEX["left_hand"]]] += [0.0, -0.6, 0.2]
        return positions

    poses, residuals = solved(seen(pulled, seconds=3.0), way)
    assert_human(poses)
    assert "left_wrist" in residuals.line() and "mm off" in residuals.line()
    assert residuals.joints()["left_wrist"].longest_s > TOLD_S
    assert residuals.joints()["right_wrist"].largest_mm == 0


@pytest.mark.parametrize(("height_m", "way"), SIZES)
def test_a_child_and_a_giant(height_m, way):
    body = humanoid(height_m)
    calibration = stage(-35.0, 35.0, height_m=height_m)

    def moving(time_s):
        q = body.rest_qpos
        wave = np.sin(2 * np.pi * 0.5 * time_s + np.arange(len(body.rest_q)))
        q[7:] = np.clip(body.rest_q + 0.4 * body.spread_rad * wave, *body.range_rad.T)
        joints = site_positions(body, q)
        lowest = min(joints[INDEX["left_toe"], 2], joints[INDEX["right_toe"], 2])
        sole = body.skeleton.rest_positions_m[OUTPUT_INDEX["LeftToeBase"], 2]
        return joints + np.array([0.0, 0.0, sole - lowest])

    frames = list(recorded(calibration, moving, SECONDS, noise_m=0.005))
    poses, residuals = solved(frames, way, calibration)
    assert_human(poses, performer(height_m))
    assert error_m(poses, 1.3, moving) < 0.03
    assert residuals.line() == "all joints"


@pytest.mark.parametrize(("height_m", "way"), SIZES)
def test_somebody_of_another_size_than_was_calibrated(height_m, way):
    """The calibrated performer is 1.78 m: the pose keeps this size, and what it cannot reach is reported."""

    def other(_t, camera, positions):
        T = STAGE.cameras[camera].T_stage_camera
        on_stage = positions @ T[:3, :3].T + T[:3, 3]
        scaled = on_stage * (height_m / 1.78)
        return (scaled - T[:3, 3]) @ T[:3, :3]

    poses, residuals = solved(seen(other), way)
    assert_human(poses)
    assert residuals.line().startswith("could not follow")


def test_the_figures_are_those_of_the_metrics_file():
    _, residuals = solved(seen(lambda _t, _camera, p: p, seconds=0.5), "studio")
    figures = residuals.figures()
    assert set(figures["not_followed"]) == set(CANONICAL)
    assert set(figures["not_followed"]["hips"]) == {"share", "longest_s", "largest_mm", "unseen_share"}
    assert figures["longest_without_anybody_s"] == 0.0
