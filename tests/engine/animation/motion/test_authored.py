import numpy as np
import pytest

from studio.engine.animation.motion.authored import (
    T_POSE_S,
    WALK_S,
    calibration_motion,
    demo_motion,
    stage_motion,
)
from studio.engine.animation.motion.proportions import AUTHORED_OFFSETS
from studio.engine.calibration.performer.tpose import tpose_problems
from studio.engine.model.joints import INDEX
from tests.engine.animation.motion.plausibility import figures

UP = np.array([0.0, 0.0, 1.0])


@pytest.fixture(scope="module")
def demo():
    return demo_motion()


@pytest.fixture(scope="module")
def walk():
    return calibration_motion(AUTHORED_OFFSETS)


@pytest.fixture(scope="module")
def stage():
    return stage_motion()


@pytest.mark.parametrize("which", ["demo", "walk", "stage"])
def test_the_performer_is_human(which, demo, walk, stage):
    seen = figures({"demo": demo, "walk": walk, "stage": stage}[which])
    assert seen["slide_m_s"] < 0.03
    assert seen["lowest_m"] > 0.02
    assert seen["bone_change_m"] < 1e-6 and seen["bone_error_m"] < 1e-6
    assert seen["fastest_m_s"] < 13
    assert seen["knee_forward_m"] > 0 and seen["straightest_knee_deg"] < 178


def test_trunk_and_arms_move_smoothly(demo, walk):
    joints = [INDEX[name] for name in ("hips", "chest", "head", "left_elbow", "right_elbow")]
    for motion in (demo, walk):
        path = motion.positions_m[:, joints]
        acceleration = np.linalg.norm(np.diff(path, n=2, axis=0), axis=-1) / motion.frame_s**2
        assert acceleration.max() < 120


def test_the_demo_ends_as_it_begins(demo):
    np.testing.assert_allclose(demo.positions_m[0], demo.positions_m[-1], atol=1e-4)


def test_a_t_pose_is_never_far_on_the_live_stage(stage):
    np.testing.assert_allclose(stage.positions_m[0], stage.positions_m[-1], atol=1e-4)
    rate_hz = 1.0 / stage.frame_s
    joints, look = stage.positions_m, round(0.5 * rate_hz)
    seen = [not tpose_problems(joints[i - look : i], UP, rate_hz) for i in range(look, len(joints), 6)]
    ends = np.flatnonzero(np.diff([0, *seen, 0]))  # in turn: one begins, one ends
    long = [(begin, end) for begin, end in ends.reshape(-1, 2) if (end - begin) * 6 / rate_hz > 2.3]
    begins_s = [begin * 6 / rate_hz for begin, _ in long]
    assert max(np.diff([*begins_s, begins_s[0] + stage.duration_s])) < 22.0


def test_the_demo_shows_what_it_promises(demo):
    hips = demo.positions_m[:, INDEX["hips"]]
    toes = demo.positions_m[:, [INDEX["left_toe"], INDEX["right_toe"]], 2].min(axis=1)
    assert hips[:, 2].min() < 0.7  # squat
    assert toes.max() > 0.25  # jump
    assert np.ptp(hips[:, 0]) > 1.8 and np.ptp(hips[:, 1]) > 1.8  # both axes
    left = demo.positions_m[:, INDEX["left_hip"]] - demo.positions_m[:, INDEX["right_hip"]]
    yaw = np.unwrap(np.arctan2(left[:, 1], left[:, 0]))
    after_jump = np.argmax(toes > 0.2)
    assert np.ptp(yaw[after_jump:]) == pytest.approx(2 * np.pi, abs=0.1)
    assert demo.hands_open.min() == 0 and demo.hands_open.max() == 1
    assert (demo.positions_m[:, INDEX["left_wrist"], 2] > 1.8).any()


def test_the_calibration_walk_covers_both_axes_after_a_still_t_pose(walk):
    assert walk.duration_s == pytest.approx(T_POSE_S + WALK_S)
    still = walk.positions_m[: round(T_POSE_S / walk.frame_s)]
    assert np.ptp(still, axis=0).max() < 1e-3
    arm = still[0, INDEX["left_hand"]] - still[0, INDEX["left_shoulder"]]
    assert arm[0] > 0.6 and np.abs(arm[1:]).max() < 1e-9
    hips = walk.positions_m[:, INDEX["hips"]]
    assert np.ptp(hips[:, 0]) > 2.3 and np.ptp(hips[:, 1]) > 2.3
    np.testing.assert_allclose(hips[-1, :2], 0, atol=0.02)


@pytest.mark.parametrize("scale", [0.6, 1.15])
def test_other_bodies_walk_as_well(scale):
    seen = figures(calibration_motion(AUTHORED_OFFSETS * scale))
    assert seen["slide_m_s"] < 0.03 and seen["lowest_m"] > 0.01 and seen["bone_error_m"] < 1e-6


def test_between_frames_and_beyond_the_ends(walk):
    np.testing.assert_allclose(walk.at(-1.0), walk.positions_m[0])
    np.testing.assert_allclose(walk.at(1e6), walk.positions_m[-1])
    middle = walk.at(10.5 * walk.frame_s)
    np.testing.assert_allclose(middle, (walk.positions_m[10] + walk.positions_m[11]) / 2)
