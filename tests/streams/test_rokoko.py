"""JSON v3 as the plugins of that program read it."""

import json

import lz4.frame
import numpy as np
from scipy.spatial.transform import Rotation

from studio.engine.model.joints import OUTPUT_INDEX
from studio.streams.rokoko import RokokoActor, RokokoEncoder
from studio.streams.unity import unity_pose


def received(datagram: bytes) -> dict:
    """The datagram as a plugin decodes it."""
    return json.loads(lz4.frame.decompress(datagram))


def test_a_frame_has_all_that_plugins_read(t_pose):
    pose = unity_pose(2.5, t_pose.positions_m[0], t_pose.rotations_wxyz[0])
    (datagram,) = RokokoEncoder(60.0).encode([RokokoActor("Ada", pose, 1.75, 0.94)])
    assert len(datagram) < 65_507
    frame = received(datagram)
    assert frame["version"] == "3.0" and frame["fps"] == 60.0 and frame["scene"]["timestamp"] == 2.5
    (actor,) = frame["scene"]["actors"]
    assert actor["name"] == "Ada" and actor["meta"]["hasGloves"] and not actor["meta"]["hasFace"]
    assert actor["dimensions"] == {"totalHeight": 1.75, "hipHeight": 0.94}
    names = {"hip", "spine", "chest", "neck", "head", "leftToeEnd", "rightLittleTip", "leftThumbMedial"}
    assert names <= set(actor["body"]) and len(actor["body"]) == 63


def test_bones_point_along_their_axes_in_the_t_pose(t_pose):
    """The rest rotations are those of the receivers' own T-pose: bones run along -y, hips and thumbs apart."""
    pose = unity_pose(0.0, t_pose.positions_m[0], t_pose.rotations_wxyz[0])
    body = received(RokokoEncoder(60.0).encode([RokokoActor("Ada", pose, 1.75, 0.94)])[0])["scene"]["actors"][
        0
    ]["body"]

    def direction(bone: str) -> np.ndarray:
        rotation = np.array([body[bone]["rotation"][k] for k in "xyzw"])
        assert abs(np.linalg.norm(rotation) - 1.0) < 1e-4
        return Rotation.from_quat(rotation).apply([0.0, -1.0, 0.0])

    np.testing.assert_allclose(direction("leftUpperArm"), [-1, 0, 0], atol=1e-4)
    np.testing.assert_allclose(direction("rightLowerArm"), [1, 0, 0], atol=1e-4)
    np.testing.assert_allclose(direction("leftLeg"), [0, -1, 0], atol=1e-4)
    np.testing.assert_allclose(direction("spine"), [0, 1, 0], atol=1e-4)
    np.testing.assert_allclose(direction("rightFoot"), [0, 0, 1], atol=1e-4)


def test_positions_and_turns_are_the_character_s(motion):
    pose = unity_pose(0.0, motion.positions_m[0], motion.rotations_wxyz[0])
    body = received(RokokoEncoder(60.0).encode([RokokoActor("Ada", pose, 1.75, 0.94)])[0])["scene"]["actors"][
        0
    ]["body"]
    index = OUTPUT_INDEX["LeftForeArm"]
    position = [body["leftLowerArm"]["position"][k] for k in "xyz"]
    np.testing.assert_allclose(position, pose.positions_m[index], atol=1e-5)
    got = Rotation.from_quat([body["leftLowerArm"]["rotation"][k] for k in "xyzw"])
    rest = Rotation.from_quat([-0.5, -0.5, 0.5, -0.5])  # of the lower left arm in the receivers' T-pose
    expected = Rotation.from_quat(pose.rotations_wxyz[index], scalar_first=True) * rest
    assert (got.inv() * expected).magnitude() < 1e-5
