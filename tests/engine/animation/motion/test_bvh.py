import warnings

import numpy as np
import pytest

from studio.engine.animation.motion.bvh import read_bvh
from studio.engine.animation.motion.motion import END
from studio.engine.base.errors import FormatError
from tests.engine.animation.motion.bvh_files import MIXAMO, bvh_text, channel_count
from tests.refused import refused

SMALL = {"hips": (None, (1, 2, 3)), "a": ("hips", (4, 0, 0)), "b": ("a", (0, 5, 0)), "c": ("hips", (0, 0, 6))}


@pytest.fixture
def write(tmp_path):
    def write_text(text: str):
        path = tmp_path / "motion.bvh"
        path.write_text(text)
        return path

    return write_text


def bvhio_positions(path, frame: int) -> dict[str, np.ndarray]:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        import bvhio

        root = bvhio.readAsHierarchy(str(path))
        root.loadPose(frame)
        return {joint.Name: np.array(list(joint.PositionWorld)) for joint, _, _ in root.layout()}


def in_stage(file_position: np.ndarray) -> np.ndarray:
    x, y, z = file_position
    return np.array([x, -z, y])


def test_joints_are_where_bvhio_puts_them(write):
    rng = np.random.default_rng(3)
    path = write(bvh_text(SMALL, rng.uniform(-170, 170, (4, channel_count(SMALL))).tolist()))
    motion = read_bvh(path, unit_m=1.0)
    for frame in range(4):
        for name, position in bvhio_positions(path, frame).items():
            ours = motion.positions_m[frame, motion.joint_names.index(name)]
            np.testing.assert_allclose(ours, in_stage(position), atol=2e-4)


def test_real_motion_is_where_bvhio_puts_it(test_data):
    path = test_data / "mocap" / "02_03.bvh"
    motion = read_bvh(path, unit_m=1.0)
    for frame in (0, 100, 173):
        for name, position in bvhio_positions(path, frame).items():
            ours = motion.positions_m[frame, motion.joint_names.index(name)]
            np.testing.assert_allclose(ours, in_stage(position), atol=2e-3)


def test_channels_in_any_order_and_case(write):
    text = bvh_text(SMALL, [[0.0] * 6 + [10, 20, 30] + [0.0] * 6])
    a = "OFFSET 4 0 0\nCHANNELS 3 "
    xyz = text.replace(a + "Zrotation Xrotation Yrotation", a + "Xrotation Yrotation Zrotation")
    path = write(xyz)
    motion = read_bvh(path, unit_m=1.0)
    np.testing.assert_allclose(motion.positions_m[0, 2], in_stage(bvhio_positions(path, 0)["b"]), atol=1e-4)
    assert not np.allclose(motion.positions_m[0, 2], read_bvh(write(text), unit_m=1.0).positions_m[0, 2])
    lower = read_bvh(write(xyz.replace("Xrotation", "xROTATION")), unit_m=1.0)
    np.testing.assert_array_equal(lower.positions_m, motion.positions_m)


def test_left_is_left_up_is_up_and_the_face_looks_to_minus_y(write):
    frame = [0.0, 95.0, 0.0] + [0.0] * (channel_count(MIXAMO) - 3)
    motion = read_bvh(write(bvh_text(MIXAMO, [frame])), unit_m=0.01)
    at = {name: motion.positions_m[0, i] for i, name in enumerate(motion.joint_names)}
    assert at["mixamorig:LeftHand"][0] > 0.5
    assert at["mixamorig:Head"][2] == pytest.approx(1.55)
    assert at["mixamorig:LeftToeBase"][1] < -0.1
    np.testing.assert_allclose(motion.rotations[0], np.broadcast_to(np.eye(3), motion.rotations[0].shape))


def test_without_a_unit_the_rest_pose_is_175_cm_high(write):
    frame = [0.0] * channel_count(MIXAMO)
    motion = read_bvh(write(bvh_text(MIXAMO, [frame])))
    head = motion.rest_m[motion.joint_names.index("mixamorig:Head" + END), 2]
    assert head - motion.rest_m[:, 2].min() == pytest.approx(1.75)


GOOD = bvh_text(SMALL, [[1.0] * 15] * 3)
BAD = {
    "empty": ("", "bvh.not_bvh"),
    "other kind": ("solid cube\nfacet", "bvh.not_bvh"),
    "cut in the hierarchy": (GOOD[: GOOD.index("JOINT b")], "bvh.cut_off_expecting"),
    "cut before the frames": (GOOD[: GOOD.index("MOTION")], "bvh.cut_off_expecting"),
    "cut between frames": ("\n".join(GOOD.splitlines()[:-1]), "bvh.cut_off"),
    "cut in a frame": (GOOD[:-10], "bvh.numbers"),
    "not a number": (GOOD.replace("1.0 1.0", "1.0 nan", 1), "bvh.numbers"),
    "infinite": (GOOD.replace("1.0 1.0", "1e999 1.0", 1), "bvh.numbers"),
    "a word": (GOOD.replace("1.0 1.0", "1.0 x", 1), "bvh.numbers"),
    "too many values": (GOOD.replace("1.0 1.0", "1.0 1.0 1.0", 1), "bvh.numbers"),
    "too many frames": (GOOD + "1.0 " * 15, "bvh.more_rows"),
    "no frame": (GOOD.replace("Frames: 3", "Frames: 0"), "bvh.frames_line"),
    "frame time 0": (GOOD.replace("Time: 0.01", "Time: 0"), "bvh.frame_time"),
    "unknown channel": (GOOD.replace("Zrotation", "Wrotation", 1), "bvh.channel"),
    "channel count": (GOOD.replace("CHANNELS 3", "CHANNELS 4", 1), "bvh.channels"),
    "name twice": (GOOD.replace("JOINT b", "JOINT a"), "bvh.joint_name"),
    "offset": (GOOD.replace("OFFSET 4 0 0", "OFFSET 4 0"), "bvh.numbers"),
    "two roots": (GOOD.replace("JOINT c", "ROOT c"), "bvh.one_root"),
    "garbage": (GOOD.replace("JOINT c", "BANANA c"), "bvh.not_here"),
}  # fmt: skip


@pytest.mark.parametrize("case", BAD)
def test_a_broken_file_gives_one_line_that_names_it(write, case):
    text, code = BAD[case]
    path = write(text)
    with refused(FormatError, code, path=str(path)) as caught:
        read_bvh(path, unit_m=1.0)
    assert "\n" not in str(caught.value)


def test_binary_and_missing_files(tmp_path):
    path = tmp_path / "noise.bvh"
    path.write_bytes(np.random.default_rng(0).bytes(4000))
    with refused(FormatError, "bvh.not_bvh"):
        read_bvh(path)
    with refused(FormatError, "bvh.unreadable"):
        read_bvh(tmp_path / "none.bvh")


def test_every_cut_of_a_file_is_a_format_error(write):
    for end in range(0, len(GOOD) - 3, 7):
        with pytest.raises(FormatError):
            read_bvh(write(GOOD[:end]), unit_m=1.0)


@pytest.mark.parametrize("unit", [0.0, -1.0, float("nan"), float("inf")])
def test_a_unit_must_be_positive(write, unit):
    with refused(FormatError, "bvh.unit"):
        read_bvh(write(GOOD), unit_m=unit)
