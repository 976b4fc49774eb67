"""Unity's axes: mirrored, y up, facing +z, and the local transforms give the world's."""

import numpy as np

from studio.engine.joints import OUTPUT_INDEX, OUTPUT_PARENTS
from studio.streams.unity import UNITY_BONES, multiply, rotate, unity_pose


def test_t_pose_faces_forward_with_the_left_hand_at_minus_x(t_pose):
    pose = unity_pose(0.0, t_pose.positions_m[0], t_pose.rotations_wxyz[0])
    joint = {name: pose.positions_m[index] for name, index in OUTPUT_INDEX.items()}
    assert joint["LeftHand"][0] < -0.5 < 0.5 < joint["RightHand"][0]
    assert joint["Head"][1] > 1.3
    assert joint["LeftToeBase"][2] > joint["LeftFoot"][2] + 0.1
    np.testing.assert_allclose(np.abs(pose.rotations_xyzw[:, 3]), 1.0)


def test_local_transforms_give_the_mirrored_world(motion):
    for frame in range(3):
        pose = unity_pose(0.0, motion.positions_m[frame], motion.rotations_wxyz[frame], scale=2.0)
        positions, rotations = np.zeros((52, 3)), np.zeros((52, 4))
        for joint, parent in enumerate(OUTPUT_PARENTS):
            position, rotation = pose.local_positions_m[joint], pose.local_rotations_xyzw[joint]
            if parent >= 0:
                position = positions[parent] + rotate(rotations[parent], position)
                rotation = multiply(rotations[parent], rotation)
            positions[joint], rotations[joint] = position, rotation
        stage = motion.positions_m[frame]
        mirrored = 2.0 * np.column_stack([-stage[:, 0], stage[:, 2], -stage[:, 1]])
        np.testing.assert_allclose(positions, mirrored, atol=1e-9)


def test_a_rotation_is_mirrored_with_the_axes(motion):
    """What a rotation does to a point of the stage, its mirror does to the point's mirror."""
    pose = unity_pose(0.0, motion.positions_m[0], motion.rotations_wxyz[0])
    point = np.array([0.3, -0.2, 0.9])
    wxyz = motion.rotations_wxyz[0]
    turned = rotate(wxyz[:, [1, 2, 3, 0]], np.broadcast_to(point, (52, 3)))
    mirror = np.column_stack([-turned[:, 0], turned[:, 2], -turned[:, 1]])
    again = rotate(pose.rotations_xyzw, np.broadcast_to([-0.3, 0.9, 0.2], (52, 3)))
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
