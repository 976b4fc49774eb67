"""Swing: rotations that point along the joints, and none where the joints do not define one."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from studio.engine.model.human.skeleton import Skeleton, forward_positions
from studio.engine.model.joints import (
    CANONICAL,
    INDEX,
    JOINT_COUNT,
    OUTPUT_JOINTS,
    OUTPUT_OF_CANONICAL_INDEX,
    PARENTS,
)
from studio.engine.solve.ik.swing import swing_rotations
from tests.engine.walkers import arms_swinging, humanoid, only, performer, site_positions, usual_q

SKELETON = Skeleton.of(performer())
LIMBS = [
    INDEX[f"{s}_{n}"] for s in ("left", "right") for n in ("elbow", "wrist", "hand", "knee", "ankle", "toe")
]


def assert_rotations(rotations):
    assert rotations.shape == (len(OUTPUT_JOINTS), 3, 3)
    assert np.abs(rotations @ rotations.swapaxes(1, 2) - np.eye(3)).max() < 1e-9
    assert np.linalg.det(rotations) == pytest.approx(1.0)


def test_the_t_pose_is_no_rotation():
    joints = SKELETON.rest_positions_m[OUTPUT_OF_CANONICAL_INDEX]
    assert np.abs(swing_rotations(SKELETON, joints) - np.eye(3)).max() < 1e-9


def test_limbs_point_where_the_joints_are():
    rng = np.random.default_rng(1)
    for _ in range(20):
        joints = site_positions(humanoid(), usual_q(humanoid(), rng))
        rotations = swing_rotations(SKELETON, joints)
        assert_rotations(rotations)
        posed = forward_positions(SKELETON, joints[0], rotations)[OUTPUT_OF_CANONICAL_INDEX]
        for joint in LIMBS:
            bone, wanted = posed[joint] - posed[PARENTS[joint]], joints[joint] - joints[PARENTS[joint]]
            assert bone == pytest.approx(wanted, abs=1e-6), CANONICAL[joint]


def test_it_turns_with_the_performer():
    joints, turn = arms_swinging(0.2), Rotation.from_euler("z", 2.0)
    turned = swing_rotations(SKELETON, turn.apply(joints))
    assert turned == pytest.approx(turn.as_matrix() @ swing_rotations(SKELETON, joints), abs=1e-6)


@pytest.mark.parametrize(
    "names", [(), ("hips", "neck"), ("left_shoulder", "right_shoulder"), ("left_wrist",)]
)
def test_without_a_trunk_there_is_no_pose(names):
    assert swing_rotations(SKELETON, only(arms_swinging(0.0), *names)) is None


@pytest.mark.parametrize(
    "make",
    [lambda j: j * 0, lambda j: j * [0, 0, 1], lambda j: j * [1, 0, 0], lambda j: j * 1e-7, lambda j: j * 1e6,
     lambda j: j[::-1], lambda j: np.tile(j[:3], (7, 1))],
    ids=["point", "line z", "line x", "tiny", "huge", "reversed", "coincident"],
)  # fmt: skip
def test_degenerate_joints_give_rotations_or_nothing(make):
    rotations = swing_rotations(SKELETON, make(arms_swinging(0.4)))
    if rotations is not None:
        assert_rotations(rotations)


def test_any_subset_of_joints_gives_rotations_or_nothing():
    rng = np.random.default_rng(2)
    for _ in range(150):
        joints = arms_swinging(rng.random()) + rng.normal(0, 0.1, (JOINT_COUNT, 3))
        joints[rng.random(JOINT_COUNT) < rng.random()] = np.nan
        rotations = swing_rotations(SKELETON, joints)
        if rotations is not None:
            assert_rotations(rotations)
