import csv

import numpy as np
import pytest

from studio.engine.animation.motion.bvh import read_bvh
from studio.engine.animation.motion.canonical import canonical_joints, to_canonical
from studio.engine.base.errors import FormatError
from studio.engine.model.joints import CANONICAL, INDEX, PARENTS
from tests.engine.animation.motion.bvh_files import MIXAMO, bvh_text, channel_count
from tests.refused import refused


def read(tmp_path, skeleton):
    frame = [0.0, 95.0, 0.0] + [0.0] * (channel_count(skeleton) - 3)
    path = tmp_path / "motion.bvh"
    path.write_text(bvh_text(skeleton, [frame, frame]))
    return read_bvh(path, unit_m=0.01)


def renamed(skeleton, rename):
    return {
        rename(name): (None if parent is None else rename(parent), offset)
        for name, (parent, offset) in skeleton.items()
    }


def test_humanik_names_with_a_prefix(tmp_path):
    motion = read(tmp_path, MIXAMO)
    names = {joint: motion.joint_names[i].split(":")[1] for joint, i in canonical_joints(motion).items()}
    assert names["chest"] == "Spine2" and names["spine"] == "Spine1" and names["neck"] == "Neck"
    assert names["left_shoulder"] == "LeftArm" and names["left_hand"] == "LeftHandMiddle1"
    assert names["right_hip"] == "RightUpLeg" and names["right_toe"] == "RightToeBase"
    assert set(names) == set(CANONICAL)


XSENS = {"Shoulder": "Collar", "Arm": "Shoulder", "ForeArm": "Elbow", "Hand": "Wrist",
         "UpLeg": "Hip", "Leg": "Knee", "Foot": "Ankle", "ToeBase": "Toe",
         "Spine": "Chest", "Spine1": "Chest2", "Spine2": "Chest4"}  # fmt: skip


def test_xsens_names(tmp_path):
    def rename(name):
        plain = name.split(":")[1]
        side = next((s for s in ("Left", "Right") if plain.startswith(s)), "")
        return side + XSENS.get(plain.removeprefix(side), plain.removeprefix(side))

    motion = read(tmp_path, renamed(MIXAMO, rename))
    plain = read(tmp_path, MIXAMO)
    np.testing.assert_allclose(to_canonical(motion).positions_m, to_canonical(plain).positions_m, atol=1e-9)


def test_a_hand_or_toe_that_is_missing_is_the_limb_end(tmp_path):
    skeleton = {name: value for name, value in MIXAMO.items() if "Middle" not in name and "Toe" not in name}
    motion = to_canonical(read(tmp_path, skeleton))
    assert np.isfinite(motion.positions_m).all()


@pytest.mark.parametrize("part", ["LeftForeArm", "RightLeg", "Head"])
def test_a_skeleton_without_a_limb_is_refused_with_its_joints(tmp_path, part):
    skeleton = renamed(MIXAMO, lambda name: name.replace(part, "Thing" + part[:1]))
    with refused(FormatError, "skeleton.joints_missing") as caught:
        to_canonical(read(tmp_path, skeleton))
    assert "mixamorig:Hips" in str(caught.value)


def test_a_skeleton_that_lies_down_is_refused(tmp_path):
    skeleton = {name: (parent, (x, -z, y)) for name, (parent, (x, y, z)) in MIXAMO.items()}
    with refused(FormatError, "skeleton.not_upright"):
        to_canonical(read(tmp_path, skeleton))


SETS = {"punches_2_cameras": "02_05", "jumps_2_cameras": "49_02",
        "jumping_jacks_3_cameras": "14_08", "ballet_4_cameras": "05_06"}  # fmt: skip


@pytest.mark.parametrize("name", SETS)
def test_cmu_joints_are_those_of_the_recordings_made_apart(test_data, name):
    """The first truth row is the skeleton with zero rotations: every joint must match the BVH joint."""
    with open(test_data / "noisy_joints" / name / "truth" / "joints.csv", newline="") as file:
        row = next(csv.DictReader(file))
    truth = np.array([[float(row[f"{joint}_{axis}"]) for axis in "xyz"] for joint in CANONICAL])
    motion = read_bvh(test_data / "mocap" / f"{SETS[name]}.bvh", unit_m=0.056444)
    joints = canonical_joints(motion)
    rest = np.array([motion.rest_m[joints[joint]] for joint in CANONICAL])
    np.testing.assert_allclose(rest - rest[0], truth - truth[0], atol=2e-4)


def test_t_pose_of_a_real_performer(test_data):
    offsets = to_canonical(read_bvh(test_data / "mocap" / "02_05.bvh", unit_m=0.056444)).offsets_m
    pose = np.zeros((len(CANONICAL), 3))
    for i, parent in enumerate(PARENTS):
        pose[i] = offsets[i] + (pose[parent] if parent >= 0 else 0)
    assert pose[INDEX["left_hand"], 0] > 0.6 and pose[INDEX["right_hand"], 0] < -0.6
    assert abs(pose[INDEX["left_hand"], 2] - pose[INDEX["left_shoulder"], 2]) < 1e-9
    assert pose[INDEX["left_toe"], 1] < pose[INDEX["left_ankle"], 1]
    assert 0 < pose[:, 2].min() < 0.03
