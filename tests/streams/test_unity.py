"""Unity's axes: mirrored, y up, facing +z, and the local transforms give the world's."""

import numpy as np
from scipy.spatial.transform import Rotation

from studio.engine.model.joints import OUTPUT_INDEX, OUTPUT_PARENTS
from studio.streams.unity import UNITY_BONES, unity_pose


def test_t_pose_faces_forward_with_the_left_hand_at_minus_x(t_pose):
    pose = unity_pose(0.0, t_pose.positions_m[0], t_pose.rotations_wxyz[0])
    joint = {name: pose.positions_m[index] for name, index in OUTPUT_INDEX.items()}
    assert joint["LeftHand"][0] < -0.5 < 0.5 < joint["RightHand"][0]
    assert joint["Head"][1] > 1.3
    assert joint["LeftToeBase"][2] > joint["LeftFoot"][2] + 0.1
    np.testing.assert_allclose(np.abs(pose.rotations_wxyz[:, 0]), 1.0)


def test_local_transforms_give_the_mirrored_world(motion):
    for frame in range(3):
        pose = unity_pose(0.0, motion.positions_m[frame], motion.rotations_wxyz[frame], scale=2.0)
        positions, rotations = np.zeros((52, 3)), Rotation.identity(52)
        for joint, parent in enumerate(OUTPUT_PARENTS):
            position = pose.local_positions_m[joint]
            rotation = Rotation.from_quat(pose.local_rotations_wxyz[joint], scalar_first=True)
            if parent >= 0:
                position = positions[parent] + rotations[parent].apply(position)
                rotation = rotations[parent] * rotation
            positions[joint], rotations[joint] = position, rotation
        stage = motion.positions_m[frame]
        mirrored = 2.0 * np.column_stack([-stage[:, 0], stage[:, 2], -stage[:, 1]])
        np.testing.assert_allclose(positions, mirrored, atol=1e-9)
        world = Rotation.from_quat(pose.rotations_wxyz, scalar_first=True)
        assert (world.inv() * rotations).magnitude().max() < 1e-7


def test_a_rotation_is_mirrored_with_the_axes(motion):
    """What a rotation does to a point of the stage, its mirror does to the point's mirror."""
    pose = unity_pose(0.0, motion.positions_m[0], motion.rotations_wxyz[0])
    point = np.array([0.3, -0.2, 0.9])
    turned = Rotation.from_quat(motion.rotations_wxyz[0], scalar_first=True).apply(point)
    mirror = np.column_stack([-turned[:, 0], turned[:, 2], -turned[:, 1]])
    again = Rotation.from_quat(pose.rotations_wxyz, scalar_first=True).apply([-0.3, 0.9, 0.2])
    np.testing.assert_allclose(again, mirror, atol=1e-12)


def test_bones_are_named_as_unity_does():
    assert len(set(UNITY_BONES)) == 52
    for name in (
        "Hips",
        "Chest",
        "UpperChest",
        "LeftUpperArm",
        "RightLowerLeg",
        "LeftToes",
        "RightLittleDistal",
    ):
        assert name in UNITY_BONES
