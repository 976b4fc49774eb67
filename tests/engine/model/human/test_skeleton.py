"""The output skeleton at rest: like the performer, mirrored, with human hands; kinematics agree with MuJoCo."""

import mujoco
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from studio.engine.model.human.skeleton import (
    HAND_LENGTH_OF_HEIGHT,
    Skeleton,
    forward_positions,
    local_rotations,
    world_rotations,
)
from studio.engine.model.joints import (
    CANONICAL,
    FINGERS,
    INDEX,
    OUTPUT_INDEX,
    OUTPUT_JOINTS,
    OUTPUT_OF_CANONICAL_INDEX,
    OUTPUT_PARENTS,
    PARENTS,
)
from tests.engine.walkers import humanoid, performer, random_q


@pytest.mark.parametrize("height_m", [0.9, 1.78, 2.3])
def test_canonical_joints_at_rest_are_the_performers(height_m):
    rest = Skeleton.of(performer(height_m)).rest_positions_m[OUTPUT_OF_CANONICAL_INDEX]
    offsets = performer(height_m).offsets_m
    for joint in range(1, len(CANONICAL)):
        assert np.allclose(rest[joint] - rest[PARENTS[joint]], offsets[joint]), CANONICAL[joint]
    assert np.allclose(rest[0], [0, 0, offsets[0, 2]])


def test_the_rest_pose_is_its_own_mirror_image():
    rest = Skeleton.of(performer()).rest_positions_m
    for name, i in OUTPUT_INDEX.items():
        if name.startswith("Left"):
            assert np.allclose(rest[i] * [-1, 1, 1], rest[OUTPUT_INDEX["Right" + name[4:]]]), name


def test_hands_are_hand_sized_with_thumbs_forward_and_fingers_outward():
    rest = Skeleton.of(performer()).rest_positions_m
    wrist, tip = rest[OUTPUT_INDEX["LeftHand"]], rest[OUTPUT_INDEX["LeftHandMiddle3"]]
    assert 0.6 < np.linalg.norm(tip - wrist) / (HAND_LENGTH_OF_HEIGHT * 1.78) < 1.0
    thumb = rest[OUTPUT_INDEX["LeftHandThumb3"]] - wrist
    assert thumb[1] < -0.03, "the thumb points forward"
    across = [rest[OUTPUT_INDEX[f"LeftHand{finger}1"]][1] for finger in FINGERS[1:]]
    assert (np.diff(across) > 0.01).all(), "index in front, little finger behind"


def test_spine_joints_lie_between_hips_and_chest():
    rest = Skeleton.of(performer()).rest_positions_m
    heights = [rest[OUTPUT_INDEX[n], 2] for n in ("Hips", "Spine", "Spine1", "Spine2", "Neck", "Head")]
    assert (np.diff(heights) > 0.01).all()
    assert np.allclose(rest[OUTPUT_INDEX["Spine1"]], rest[OUTPUT_OF_CANONICAL_INDEX[INDEX["spine"]]])
    assert np.allclose(rest[OUTPUT_INDEX["Spine2"]], rest[OUTPUT_OF_CANONICAL_INDEX[INDEX["chest"]]])


def test_forward_kinematics_agrees_with_mujoco():
    body, rng = humanoid(), np.random.default_rng(5)
    data = mujoco.MjData(body.model)
    for _ in range(10):
        data.qpos[:] = random_q(body, rng)
        mujoco.mj_kinematics(body.model, data)
        rotations = np.tile(np.eye(3), (len(OUTPUT_JOINTS), 1, 1))
        rotations[body.body_outputs] = data.xmat[body.body_ids].reshape(-1, 3, 3)
        positions = forward_positions(body.skeleton, data.qpos[:3], rotations)
        assert np.abs(positions[body.body_outputs] - data.xpos[body.body_ids]).max() < 1e-12


def test_local_and_world_rotations_are_each_others_inverse():
    world = Rotation.random(len(OUTPUT_JOINTS), random_state=2).as_matrix()
    local = local_rotations(world)
    assert np.abs(world_rotations(local) - world).max() < 1e-12
    assert np.allclose(local[0], world[0])
    joint = OUTPUT_INDEX["LeftForeArm"]
    assert np.allclose(world[OUTPUT_PARENTS[joint]] @ local[joint], world[joint])
