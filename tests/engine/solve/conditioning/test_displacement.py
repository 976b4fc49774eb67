"""Displacement limits: no joint exceeds its limit, bones keep their length, and joints catch up."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from studio.engine.model.human.skeleton import Skeleton, forward_positions, world_rotations
from studio.engine.model.joints import (
    CANONICAL,
    INDEX,
    JOINT_COUNT,
    OUTPUT_JOINTS,
    OUTPUT_OF_CANONICAL_INDEX,
    OUTPUT_PARENTS,
    PARENTS,
)
from studio.engine.solve.conditioning.displacement import (
    DEFAULT_M_S,
    DisplacementLimitAfter,
    DisplacementLimitBefore,
    limits_m_s,
)
from tests.engine.walkers import performer, standing

DT = 1 / 60
LIMITS = np.array([DEFAULT_M_S[name] for name in CANONICAL])


def relative(joints):
    return joints - np.where(PARENTS[:, None] < 0, 0.0, joints[PARENTS])


def test_every_canonical_joint_has_a_limit_and_an_operators_own_counts():
    assert set(DEFAULT_M_S) == set(CANONICAL) and min(DEFAULT_M_S.values()) > 0.5
    assert limits_m_s({"head": 0.3})["head"] == 0.3
    assert limits_m_s({"head": 0.3})["neck"] == DEFAULT_M_S["neck"]


def test_before_no_joint_is_faster_than_its_limit():
    limit, rng = DisplacementLimitBefore(DEFAULT_M_S), np.random.default_rng(1)
    last = limit.apply(standing(), DT)
    assert last == pytest.approx(standing())
    for _ in range(20):
        now = limit.apply(standing() + rng.normal(0, 0.3, (JOINT_COUNT, 3)), DT)
        speed = np.linalg.norm(relative(now) - relative(last), axis=1) / DT
        assert (speed <= LIMITS + 1e-6).all()
        last = now


def test_before_slow_motion_passes_and_a_jump_is_caught_up():
    limit = DisplacementLimitBefore(DEFAULT_M_S)
    for k in range(10):
        joints = standing() + np.array([0.01 * k, 0, 0])
        assert limit.apply(joints, DT) == pytest.approx(joints)
    for _ in range(60):
        out = limit.apply(standing() + 1.0, DT)
    assert out == pytest.approx(standing() + 1.0)


def test_before_unseen_joints_pass_as_unseen_and_come_back_held():
    limit, wrist = DisplacementLimitBefore(DEFAULT_M_S), INDEX["left_wrist"]
    limit.apply(standing(), DT)
    joints = standing()
    joints[wrist] = np.nan
    out = limit.apply(joints, DT)
    assert np.isnan(out[wrist]).all()
    seen = np.arange(JOINT_COUNT) != wrist
    seen[INDEX["left_hand"]] = False
    assert out[seen] == pytest.approx(joints[seen])
    nobody = limit.apply(np.full((JOINT_COUNT, 3), np.nan), DT)
    assert np.isnan(nobody).all()
    assert np.isfinite(limit.apply(standing(), DT)).all()


SKELETON = Skeleton.of(performer())


def pose(rng, spread_rad):
    local = Rotation.from_rotvec(rng.normal(0, spread_rad, (len(OUTPUT_JOINTS), 3))).as_matrix()
    return rng.normal(0, 0.2, 3) + np.array([0, 0, 1]), local


def positions(root, local):
    return forward_positions(SKELETON, root, world_rotations(local))


def test_after_no_joint_turns_its_child_faster_than_the_limit_and_bones_keep_their_length():
    limit, rng = DisplacementLimitAfter(SKELETON, DEFAULT_M_S), np.random.default_rng(3)
    last = limit.apply(*pose(rng, 0.5), DT)
    lengths = np.linalg.norm(SKELETON.offsets_m, axis=1)[1:]
    by_output = dict(zip(OUTPUT_OF_CANONICAL_INDEX, LIMITS, strict=True))
    for _ in range(15):
        now = limit.apply(*pose(rng, 0.8), DT)
        joints = positions(*now)
        assert np.abs(np.linalg.norm(joints[1:] - joints[OUTPUT_PARENTS[1:]], axis=1) - lengths).max() < 1e-9
        assert np.linalg.norm(now[0] - last[0]) <= DEFAULT_M_S["hips"] * DT + 1e-9
        step = np.einsum("jab,jb->ja", now[1][OUTPUT_PARENTS[1:]], SKELETON.offsets_m[1:]) - np.einsum(
            "jab,jb->ja", last[1][OUTPUT_PARENTS[1:]], SKELETON.offsets_m[1:]
        )  # each joint's movement in the axes of its grandparent
        for joint in range(1, len(OUTPUT_JOINTS)):
            allowed = by_output.get(joint, 2.0) * DT
            assert np.linalg.norm(step[joint - 1]) <= allowed + 1e-6, OUTPUT_JOINTS[joint]
        last = now


def test_after_it_reaches_the_pose_in_the_end_and_slow_motion_passes():
    rng = np.random.default_rng(4)
    limit = DisplacementLimitAfter(SKELETON, DEFAULT_M_S)
    start, goal = pose(rng, 0.3), pose(rng, 0.3)
    assert limit.apply(*start, DT)[1] == pytest.approx(start[1])
    for _ in range(120):
        root, local = limit.apply(*goal, DT)
    assert root == pytest.approx(goal[0]) and local == pytest.approx(goal[1], abs=1e-6)


def test_after_no_time_holds_the_pose():
    rng = np.random.default_rng(5)
    limit = DisplacementLimitAfter(SKELETON, DEFAULT_M_S)
    root, local = limit.apply(*pose(rng, 0.4), DT)
    again = limit.apply(*pose(rng, 0.4), 0.0)
    assert again[0] == pytest.approx(root) and again[1] == pytest.approx(local)
