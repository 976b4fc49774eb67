"""Smoothness, latency, feet and bones against closed-form cases."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from studio.engine.metrics.evaluate import evaluate
from studio.engine.metrics.figures.bones import bone_length_sd_mm
from studio.engine.metrics.figures.feet import foot_slides_cm_s
from studio.engine.metrics.figures.latency import latency_ms
from studio.engine.metrics.figures.smoothness import acceleration_error_m_s2, jerk_m_s3, reference_jerk_m_s3
from studio.engine.metrics.reference.matching import match
from studio.engine.model.human.skeleton import Skeleton, forward_positions
from studio.engine.model.joints import CANONICAL, INDEX, MEASURED_JOINTS, OUTPUT_INDEX, OUTPUT_JOINTS
from studio.engine.model.poses import Poses
from tests.engine.metrics.cases import dance, poses_of, reference_of, still
from tests.engine.walkers import performer

RATE = 60.0
TIME = np.arange(300) / RATE


STEP = 1 / 30.0
RATES = [30.0, 60.0, 120.0]


@pytest.mark.parametrize("rate", RATES)
def test_a_parabola_has_its_acceleration_and_no_jerk(rate):
    time = np.arange(300) / rate
    moved = still(300) + 0.5 * 3.0 * time[:, None, None] ** 2 * np.array([1.0, 0.0, 0.0])
    matched = match(poses_of(time, moved), reference_of(time, still(300)))
    assert acceleration_error_m_s2(matched) == pytest.approx(3.0, abs=1e-9)
    assert jerk_m_s3(matched) == pytest.approx(0.0, abs=1e-6)


@pytest.mark.parametrize("rate", RATES)
def test_a_cubic_has_its_jerk(rate):
    time = np.arange(120) / rate
    moved = still(120) + time[:, None, None] ** 3 / 6 * np.array([0.0, 30.0, 40.0])
    matched = match(poses_of(time, moved), reference_of(time, still(120)))
    assert jerk_m_s3(matched) == pytest.approx(50.0, abs=1e-7)
    assert reference_jerk_m_s3(matched) == pytest.approx(0.0, abs=1e-7)


@pytest.mark.parametrize("rate", RATES)
def test_a_sine_has_the_differences_over_a_thirtieth_of_a_second(rate):
    """The second difference of sin(wt) is -4 sin^2(w dt / 2) / dt^2 times sin(wt), at every rate with the same dt."""
    w, amplitude = 2 * np.pi * 1.5, 0.1
    time = np.arange(300) / rate
    wave = amplitude * np.sin(w * time)
    moved = still(300) + wave[:, None, None] * np.array([0.0, 0.0, 1.0])
    matched = match(poses_of(time, moved), reference_of(time, still(300)))
    stride, factor = round(rate * STEP), 2 * np.sin(w * STEP / 2) / STEP
    expected = factor**2 * np.abs(wave[stride:-stride]).mean()
    assert acceleration_error_m_s2(matched) == pytest.approx(expected, abs=1e-9)
    middle = amplitude * np.cos(w * (time[: -3 * stride] + 1.5 * STEP))
    assert jerk_m_s3(matched) == pytest.approx(factor**3 * np.abs(middle).mean(), abs=1e-9)


def test_every_frame_begins_a_difference():
    """At 60 Hz a jolt in an odd frame counts as much as one in an even frame."""
    errors = []
    for frame in (100, 101):
        moved = still(300)
        moved[frame] += [0.0, 0.01, 0.0]
        errors.append(acceleration_error_m_s2(match(poses_of(TIME, moved), reference_of(TIME, still(300)))))
    assert errors[0] == pytest.approx(errors[1], abs=1e-9)
    assert errors[0] == pytest.approx(4 * 0.01 / STEP**2 / 296, abs=1e-9)


def test_a_solve_slower_than_the_step_uses_its_own_rate():
    time = np.arange(100) / 20
    moved = still(100) + 0.5 * 3.0 * time[:, None, None] ** 2 * np.array([1.0, 0.0, 0.0])
    matched = match(poses_of(time, moved), reference_of(time, still(100)))
    assert acceleration_error_m_s2(matched) == pytest.approx(3.0, abs=1e-9)


def test_a_gap_in_the_solve_makes_no_jerk():
    keep = np.ones(300, dtype=bool)
    keep[100:130] = False
    motion = still(300) + TIME[:, None, None] * np.array([1.0, 0.0, 0.0])
    matched = match(poses_of(TIME[keep], motion[keep]), reference_of(TIME, motion))
    assert jerk_m_s3(matched) == pytest.approx(0.0, abs=1e-6)


def test_a_solve_shorter_than_the_differences_has_none():
    matched = match(poses_of(TIME[:6], still(6)), reference_of(TIME, still(300)))
    assert acceleration_error_m_s2(matched) == pytest.approx(0.0)
    assert jerk_m_s3(matched) is None


@pytest.mark.parametrize("lag_s", [0.0, 0.0123, 0.05, -0.02])
def test_latency_is_the_delay_of_the_solve(lag_s):
    time = np.arange(0, 10, 1 / RATE)
    dense = np.arange(0, 10, 1 / 240)
    reference = reference_of(dense, dance(dense))
    matched = match(poses_of(time, dance(time - lag_s)), reference)
    assert latency_ms(matched, reference) == pytest.approx(lag_s * 1e3, abs=0.01)


def test_latency_needs_motion():
    reference = reference_of(TIME, still(300))
    assert latency_ms(match(poses_of(TIME, still(300)), reference), reference) is None


def test_a_sliding_foot_is_as_fast_as_it_slides():
    truth = still(300)
    for name, height in (
        ("left_ankle", 0.08),
        ("right_ankle", 0.08),
        ("left_toe", 0.02),
        ("right_toe", 0.02),
    ):
        truth[:, INDEX[name], 2] = height
    truth[150:, INDEX["right_ankle"]] += [0.0, 0.0, 0.3]  # lifted: this ankle stands in the first half only
    truth[150:, INDEX["right_toe"]] += [0.0, 0.0, 0.3]
    moved = truth + 0.07 * TIME[:, None, None] * np.array([0.6, 0.8, 0.0])
    slide, reference_slide = foot_slides_cm_s(match(poses_of(TIME, moved), reference_of(TIME, truth)))
    assert slide == pytest.approx(7.0, abs=1e-9)
    assert reference_slide == pytest.approx(0.0, abs=1e-9)


def test_the_height_of_the_ankle_over_the_sole_does_not_matter():
    truth = still(300)
    truth[..., 2] += 3.0  # the reference's floor is not at z = 0
    assert foot_slides_cm_s(match(poses_of(TIME, truth), reference_of(TIME, truth)))[0] == pytest.approx(0.0)


def test_a_foot_that_never_rests_has_no_slide():
    moving = still(300) + TIME[:, None, None] * np.array([1.0, 0.0, 0.0])
    assert foot_slides_cm_s(match(poses_of(TIME, moving), reference_of(TIME, moving))) == (None, None)


def test_a_bone_whose_length_alternates():
    """+-5 mm along one of the 23 bones that carry canonical joints (52 joints less 28 of fingers and the root)."""
    poses = poses_of(TIME, still(300))
    positions = poses.positions_m.copy()
    tip, wrist = (poses.joint_names.index(name) for name in ("LeftHandMiddle1", "LeftHand"))
    along = positions[0, tip] - positions[0, wrist]
    positions[:, tip] += np.outer(0.005 * (-1.0) ** np.arange(300), along / np.linalg.norm(along))
    finger = poses.joint_names.index("LeftHandIndex2")
    positions[:, finger, 0] += 0.1 * np.sin(TIME)  # carries no canonical joint
    matched = match(replace(poses, positions_m=positions), reference_of(TIME, still(300)))
    assert bone_length_sd_mm(matched) == pytest.approx(5.0 / 23, abs=1e-9)


def test_a_skeleton_that_bends_is_rigid():
    """The spine is two bones from the hips, the shoulder two from the chest: distances shrink as those bend."""
    skeleton = Skeleton.of(performer())
    turns = np.random.default_rng(0).normal(0, 0.5, (300, len(OUTPUT_JOINTS), 3))
    rotations = Rotation.from_rotvec(turns.reshape(-1, 3)).as_matrix().reshape(300, -1, 3, 3)
    positions = np.array([forward_positions(skeleton, np.array([0.3, 0.1, 1.0]), r) for r in rotations])
    poses = replace(poses_of(TIME, still(300)), positions_m=positions)
    spine = np.linalg.norm(positions[:, OUTPUT_INDEX["Spine1"]] - positions[:, OUTPUT_INDEX["Hips"]], axis=1)
    assert spine.std() > 0.001
    assert bone_length_sd_mm(match(poses, reference_of(TIME, still(300)))) == 0.0


def test_bones_of_a_take_without_hierarchy_are_the_canonical_ones():
    """Example: a file of joint positions, with canonical names, every joint a root, and no feet."""
    names = tuple(name for name in CANONICAL if "toe" not in name and "ankle" not in name)
    motion = still(300)
    head = motion[0, INDEX["head"]] - motion[0, INDEX["neck"]]
    motion[:, INDEX["head"]] += np.outer(0.005 * (-1.0) ** np.arange(300), head / np.linalg.norm(head))
    poses = Poses(
        time_s=TIME,
        joint_names=names,
        parents=np.full(len(names), -1),
        positions_m=motion[:, [INDEX[name] for name in names]],
        rotations_wxyz=np.tile([1.0, 0.0, 0.0, 0.0], (300, len(names), 1)),
        confidence=np.ones((300, len(names))),
        uncertainty_mm=np.full((300, len(names)), np.nan),
    )
    assert bone_length_sd_mm(match(poses, reference_of(TIME, still(300)))) == pytest.approx(
        5.0 / 16, abs=1e-9
    )


def test_unseen_joints_are_counted_over_the_measured_ones():
    poses = poses_of(TIME, dance(TIME))
    confidence = poses.confidence.copy()
    confidence[:100, list(poses.joint_names).index("LeftHand")] = 0.0
    figures = evaluate(replace(poses, confidence=confidence), reference_of(TIME, dance(TIME)))
    assert figures["unseen_share"] == pytest.approx(100 / 300 / len(MEASURED_JOINTS))
