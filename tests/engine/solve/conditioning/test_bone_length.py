"""Bone length limit: bones within the tolerance, directions kept."""

import numpy as np
import pytest

from studio.engine.model.joints import INDEX, JOINT_COUNT, PARENTS
from studio.engine.solve.conditioning.bone_length import BoneLengthLimit
from tests.engine.walkers import performer, standing

OFFSETS = performer().offsets_m
LENGTHS = np.linalg.norm(OFFSETS, axis=1)[1:]


def bones(joints):
    return joints[1:] - joints[PARENTS[1:]]


@pytest.mark.parametrize("tolerance", [0.0, 0.02, 0.2])
def test_every_bone_is_within_the_tolerance_and_keeps_its_direction(tolerance):
    rng = np.random.default_rng(1)
    joints = standing() + rng.normal(0, 0.05, (JOINT_COUNT, 3))
    out = BoneLengthLimit(OFFSETS, tolerance).apply(joints)
    length = np.linalg.norm(bones(out), axis=1)
    assert (length <= LENGTHS * (1 + tolerance) + 1e-9).all()
    assert (length >= LENGTHS * (1 - tolerance) - 1e-9).all()
    before = np.linalg.norm(bones(joints), axis=1)
    cosine = (bones(out) * bones(joints)).sum(axis=1) / (length * before)
    assert cosine.min() > 1 - 1e-9
    assert np.array_equal(out[INDEX["hips"]], joints[INDEX["hips"]])


def test_a_body_within_the_tolerance_is_left_as_it_is():
    assert BoneLengthLimit(OFFSETS, 0.02).apply(standing()) == pytest.approx(standing())


def test_unseen_joints_stay_unseen_and_the_input_is_not_changed():
    joints = standing() + 0.1 * np.random.default_rng(2).normal(size=(JOINT_COUNT, 3))
    joints[INDEX["left_elbow"]] = np.nan
    joints[INDEX["hips"]] = np.nan
    before = joints.copy()
    out = BoneLengthLimit(OFFSETS, 0.02).apply(joints)
    assert np.array_equal(np.isnan(out), np.isnan(joints)) and np.array_equal(before, joints, equal_nan=True)
    knee = np.linalg.norm(out[INDEX["left_knee"]] - out[INDEX["left_hip"]])
    assert knee == pytest.approx(np.linalg.norm(OFFSETS[INDEX["left_knee"]]), rel=0.0201)


def test_joints_in_one_place_are_left_alone():
    assert np.isfinite(BoneLengthLimit(OFFSETS, 0.02).apply(np.zeros((JOINT_COUNT, 3)))).all()
