"""Smoothness, latency, feet and bones against closed-form cases."""

from dataclasses import replace

import numpy as np
import pytest

from studio.engine.joints import INDEX, MEASURED_JOINTS
from studio.engine.metrics.bones import bone_length_sd_mm
from studio.engine.metrics.evaluate import evaluate
from studio.engine.metrics.feet import foot_slides_cm_s
from studio.engine.metrics.latency import latency_ms
from studio.engine.metrics.matching import match
from studio.engine.metrics.smoothness import acceleration_error_m_s2, jerk_m_s3, reference_jerk_m_s3
from tests.engine.metrics.cases import dance, poses_of, reference_of, still

RATE = 60.0
TIME = np.arange(300) / RATE


def test_a_parabola_has_its_acceleration_and_no_jerk():
    truth = still(300)
    moved = truth + 0.5 * 3.0 * TIME[:, None, None] ** 2 * np.array([1.0, 0.0, 0.0])
    matched = match(poses_of(TIME, moved), reference_of(TIME, truth))
    assert acceleration_error_m_s2(matched) == pytest.approx(3.0, abs=1e-7)
    assert jerk_m_s3(matched) == pytest.approx(0.0, abs=1e-6)


def test_a_sine_has_the_second_difference_of_a_sine():
    """The second difference of sin(wt) is -4 sin^2(w dt / 2) / dt^2 times it."""
    w, amplitude, truth = 2 * np.pi * 1.5, 0.1, still(300)
    wave = amplitude * np.sin(w * TIME)
    moved = truth + wave[:, None, None] * np.array([0.0, 0.0, 1.0])
    matched = match(poses_of(TIME, moved), reference_of(TIME, truth))
    factor = 2 * np.sin(w / RATE / 2) * RATE
    assert acceleration_error_m_s2(matched) == pytest.approx(factor**2 * np.abs(wave[1:-1]).mean(), abs=1e-9)
    middle = amplitude * np.cos(w * (TIME[1:-2] + 0.5 / RATE))
    assert jerk_m_s3(matched) == pytest.approx(factor**3 * np.abs(middle).mean(), abs=1e-7)
    assert reference_jerk_m_s3(matched) == pytest.approx(0.0, abs=1e-6)


def test_a_gap_in_the_solve_makes_no_jerk():
    keep = np.ones(300, dtype=bool)
    keep[100:130] = False
    motion = still(300) + TIME[:, None, None] * np.array([1.0, 0.0, 0.0])
    matched = match(poses_of(TIME[keep], motion[keep]), reference_of(TIME, motion))
    assert jerk_m_s3(matched) == pytest.approx(0.0, abs=1e-6)


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


def test_bone_lengths_that_alternate():
    """Hands that move along the forearm's direction by +-5 mm: one bone of 20 varies with an SD of 5 mm."""
    motion = still(300)
    arm = motion[0, INDEX["left_hand"]] - motion[0, INDEX["left_wrist"]]
    motion[:, INDEX["left_hand"]] += np.outer(0.005 * (-1.0) ** np.arange(300), arm / np.linalg.norm(arm))
    matched = match(poses_of(TIME, motion), reference_of(TIME, still(300)))
    assert bone_length_sd_mm(matched) == pytest.approx(5.0 / 20, abs=1e-9)


def test_unseen_joints_are_counted_over_the_measured_ones():
    poses = poses_of(TIME, dance(TIME))
    confidence = poses.confidence.copy()
    confidence[:100, list(poses.joint_names).index("LeftHand")] = 0.0
    figures = evaluate(replace(poses, confidence=confidence), reference_of(TIME, dance(TIME)))
    assert figures["unseen_share"] == pytest.approx(100 / 300 / len(MEASURED_JOINTS))
