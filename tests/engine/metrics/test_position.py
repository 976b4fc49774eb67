"""Positions against closed-form cases."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from studio.engine.base.geometry import make_transform, transform_points
from studio.engine.metrics.evaluate import evaluate
from studio.engine.metrics.figures.position import mpjpe_mm, mpjpe_root_aligned_mm, per_joint_mm, rms_mm
from studio.engine.metrics.reference.alignment import align
from studio.engine.metrics.reference.matching import match
from studio.engine.model.joints import INDEX, MEASURED_JOINTS
from tests.engine.metrics.cases import dance, poses_of, reference_of, shifted, still

TIME = np.arange(120) / 60.0


@settings(max_examples=20, deadline=None)
@given(
    seed=st.integers(0, 2**16),
    angles=st.tuples(*[st.floats(-3.0, 3.0)] * 3),
    move=st.tuples(*[st.floats(-5.0, 5.0)] * 3),
)
def test_a_rigid_move_of_the_take_costs_nothing(seed, angles, move):
    truth = dance(TIME, seed)
    T = make_transform(Rotation.from_euler("xyz", angles).as_matrix(), np.array(move))
    matched, alignment = align(match(poses_of(TIME, transform_points(T, truth)), reference_of(TIME, truth)))
    assert mpjpe_mm(matched) < 1e-9
    assert np.allclose(alignment.T_reference_stage @ T, np.eye(4), atol=1e-9)


def test_joint_shifts_are_counted_by_joint():
    truth = dance(TIME)
    moved = shifted(truth, {"left_wrist": [0.03, 0.0, 0.04], "hips": [0.0, 0.01, 0.0]})
    matched = match(poses_of(TIME, moved), reference_of(TIME, truth))  # not aligned: shifts remain
    assert mpjpe_mm(matched) == pytest.approx((50.0 + 10.0) / 15, abs=1e-9)
    assert per_joint_mm(matched, ["left_wrist", "hips", "head"]) == pytest.approx(
        {"left_wrist": 50.0, "hips": 10.0, "head": 0.0}, abs=1e-9
    )
    assert rms_mm(matched) == pytest.approx(np.sqrt((2500.0 + 100.0) / 15), abs=1e-9)
    hips_moved = 13 * 10.0 + np.linalg.norm([30.0, 10.0, 40.0])
    assert mpjpe_root_aligned_mm(matched) == pytest.approx(hips_moved / 15, abs=1e-9)


def test_alignment_does_not_follow_the_pose_over_time():
    """Half of the take is 20 cm to one side, which alignment cannot remove: 10 cm remain each way."""
    truth = still(120)
    moved = truth.copy()
    moved[:60] += [0.2, 0.0, 0.0]
    matched, _ = align(match(poses_of(TIME, moved), reference_of(TIME, truth)))
    assert mpjpe_mm(matched) == pytest.approx(100.0, abs=1e-6)


def test_joints_that_the_reference_lacks_are_left_out():
    truth = dance(TIME)
    truth[:, INDEX["head"]] = np.nan
    truth[30:40, INDEX["left_knee"]] = np.nan
    figures = evaluate(poses_of(TIME, dance(TIME)), reference_of(TIME, truth))
    assert figures["matched_joints"] == [name for name in MEASURED_JOINTS if name != "head"]
    assert "head" not in figures["per_joint_mm"]
    assert figures["mpjpe_mm"] < 1e-9


def test_only_what_follows_the_calibration_part_counts():
    truth = dance(TIME)
    moved = truth.copy()
    moved[:60] += np.random.default_rng(1).normal(0, 0.1, (60, 21, 3))
    figures = evaluate(poses_of(TIME, moved), reference_of(TIME, truth), start_s=1.0)
    assert figures["frames"] == 60
    assert figures["mpjpe_mm"] < 1e-9
