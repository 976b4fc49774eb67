"""Mappings from joint sets to canonical joints to the output skeleton."""

import itertools

import numpy as np
import pytest

from studio.engine.base.errors import FormatError
from studio.engine.model.joints import (
    CANONICAL,
    INDEX,
    JOINT_COUNT,
    JOINT_SETS,
    MEASURED_JOINTS,
    MIRROR,
    OUTPUT_INDEX,
    OUTPUT_JOINTS,
    OUTPUT_OF_CANONICAL,
    OUTPUT_OF_CANONICAL_INDEX,
    OUTPUT_PARENT,
    OUTPUT_PARENTS,
    PARENT_OF_CANONICAL,
    PARENTS,
    to_canonical,
)
from tests.refused import refused

COUNTS = {
    "openni": 15,
    "kinect-v1": 20,
    "kinect-v2": 25,
    "azure-kinect": 32,
    "mediapipe": 33,
    "canonical": 21,
}

# canonical joint: device joints, in full, written down apart from the mapping under test
KINECT = {
    "head": "Head", "left_shoulder": "ShoulderLeft", "left_elbow": "ElbowLeft", "left_wrist": "WristLeft",
    "left_hand": "HandLeft", "left_hip": "HipLeft", "left_knee": "KneeLeft", "left_ankle": "AnkleLeft",
    "left_toe": "FootLeft", "right_shoulder": "ShoulderRight", "right_elbow": "ElbowRight",
    "right_wrist": "WristRight", "right_hand": "HandRight", "right_hip": "HipRight", "right_knee": "KneeRight",
    "right_ankle": "AnkleRight", "right_toe": "FootRight",
}  # fmt: skip
TRUNK = "left_hip+right_hip+left_shoulder+right_shoulder"
EXPECTED = {
    "canonical": {name: name for name in CANONICAL},
    "openni": {
        "head": "head", "neck": "neck", "spine": "torso", "hips": "left_hip+right_hip",
        "left_shoulder": "left_shoulder", "left_elbow": "left_elbow", "left_wrist": "left_hand",
        "right_shoulder": "right_shoulder", "right_elbow": "right_elbow", "right_wrist": "right_hand",
        "left_hip": "left_hip", "left_knee": "left_knee", "left_ankle": "left_foot",
        "right_hip": "right_hip", "right_knee": "right_knee", "right_ankle": "right_foot",
    },
    "kinect-v1": KINECT | {"hips": "HipCenter", "spine": "Spine", "neck": "ShoulderCenter"},
    "kinect-v2": KINECT | {"hips": "SpineBase", "spine": "SpineMid", "chest": "SpineShoulder", "neck": "Neck"},
    "azure-kinect": {
        "hips": "PELVIS", "spine": "SPINE_NAVEL", "chest": "SPINE_CHEST", "neck": "NECK", "head": "HEAD",
        **{f"{side}_{part}": f"{device}_{side.upper()}" for side in ("left", "right") for part, device in (
            ("shoulder", "SHOULDER"), ("elbow", "ELBOW"), ("wrist", "WRIST"), ("hand", "HAND"), ("hip", "HIP"),
            ("knee", "KNEE"), ("ankle", "ANKLE"), ("toe", "FOOT"))},
    },
    "mediapipe": {
        "head": "left_ear+right_ear", **dict.fromkeys(("hips", "neck"), TRUNK),
        **{f"{side}_{part}": "+".join(f"{side}_{d}" for d in device.split("+"))
           for side in ("left", "right") for part, device in (
            ("shoulder", "shoulder"), ("elbow", "elbow"), ("wrist", "wrist"), ("hand", "index+pinky"),
            ("hip", "hip"), ("knee", "knee"), ("ankle", "ankle"), ("toe", "foot_index"))},
    },
}  # fmt: skip


@pytest.mark.parametrize("joint_set", JOINT_SETS)
def test_every_device_joint_lands_on_the_right_canonical_joint(joint_set):
    names = JOINT_SETS[joint_set]
    assert len(names) == len(set(names)) == COUNTS[joint_set]
    rng = np.random.default_rng(1)
    positions, confidence = rng.normal(size=(len(names), 3)), rng.uniform(0.1, 1, len(names))
    out, sure = to_canonical(joint_set, positions, confidence)
    for name in CANONICAL:
        if name not in EXPECTED[joint_set]:
            assert np.isnan(out[INDEX[name]]).all() and sure[INDEX[name]] == 0, name
            continue
        parts = [names.index(device) for device in EXPECTED[joint_set][name].split("+")]
        weights = None
        if EXPECTED[joint_set][name] == TRUNK:  # HumanIK's default character: 6.3 and 51.3 cm of 52.9
            up = {"hips": 0.119, "neck": 0.97}[name]
            weights = [1.0 - up, 1.0 - up, up, up]
        assert np.allclose(out[INDEX[name]], np.average(positions[parts], axis=0, weights=weights)), name
        assert sure[INDEX[name]] == pytest.approx(confidence[parts].min()), name


@pytest.mark.parametrize("joint_set", JOINT_SETS)
@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
def test_a_joint_that_is_not_finite_is_unseen_and_spoils_no_other(joint_set, bad):
    names = JOINT_SETS[joint_set]
    positions, confidence = np.ones((len(names), 3)), np.ones(len(names))
    full, _ = to_canonical(joint_set, positions, confidence)
    for k, device in enumerate(names):
        spoiled = positions.copy()
        spoiled[k, 1] = bad
        out, sure = to_canonical(joint_set, spoiled, confidence)
        for name, parts in EXPECTED[joint_set].items():
            seen = device not in parts.split("+")
            assert np.isfinite(out[INDEX[name]]).all() == seen and (sure[INDEX[name]] > 0) == seen
            assert np.isnan(out[INDEX[name]]).all() == (not seen), "wholly unseen, not by one number"
    assert not np.isinf(full).any()


def test_confidence_is_brought_into_0_to_1_and_the_input_is_not_changed():
    positions, confidence = np.zeros((21, 3)), np.full(21, np.nan)
    confidence[0], confidence[1] = 7.0, -1.0
    before = confidence.copy()
    _, sure = to_canonical("canonical", positions, confidence)
    assert sure[0] == 1.0 and sure[1] == 0.0 and (sure[2:] == 0).all()
    assert np.array_equal(before, confidence, equal_nan=True)


@pytest.mark.parametrize("joint_set", JOINT_SETS)
@pytest.mark.parametrize("change", [-1, 1])
def test_a_wrong_number_of_joints_is_refused(joint_set, change):
    count = COUNTS[joint_set] + change
    with refused(FormatError, "joints.shape", n=COUNTS[joint_set]):
        to_canonical(joint_set, np.zeros((count, 3)), np.ones(count))


def test_an_unknown_joint_set_is_refused_with_the_known_ones():
    with refused(FormatError, "joints.unknown_set"):
        to_canonical("kinect-v9", np.zeros((21, 3)), np.ones(21))


def test_there_are_21_canonical_joints_with_parents_first():
    assert JOINT_COUNT == len(CANONICAL) == len(set(CANONICAL)) == 21
    assert PARENTS[INDEX["hips"]] == -1 and (PARENTS < np.arange(21)).all()
    for child, parent in PARENT_OF_CANONICAL.items():
        assert PARENTS[INDEX[child]] == INDEX[parent]
    assert PARENT_OF_CANONICAL["left_shoulder"] == "chest" and PARENT_OF_CANONICAL["right_hip"] == "hips"
    assert (PARENTS == -1).sum() == 1


def test_mirror_swaps_left_and_right_and_nothing_else():
    assert (MIRROR[MIRROR] == np.arange(21)).all()
    for name in CANONICAL:
        other = {"left": "right", "right": "left"}.get(name.split("_")[0])
        expected = f"{other}_{name.split('_')[1]}" if other else name
        assert CANONICAL[MIRROR[INDEX[name]]] == expected


def test_the_output_skeleton_is_humanik_with_parents_first():
    assert len(OUTPUT_JOINTS) == len(set(OUTPUT_JOINTS)) == 52
    assert (OUTPUT_PARENTS < np.arange(52)).all() and (OUTPUT_PARENTS == -1).sum() == 1
    for chain in (
        "Hips Spine Spine1 Spine2 Neck Head",
        "Spine2 LeftShoulder LeftArm LeftForeArm LeftHand LeftHandMiddle1 LeftHandMiddle2 LeftHandMiddle3",
        "Spine2 RightShoulder RightArm RightForeArm RightHand RightHandThumb1 RightHandThumb2 RightHandThumb3",
        "Hips LeftUpLeg LeftLeg LeftFoot LeftToeBase",
        "Hips RightUpLeg RightLeg RightFoot RightToeBase",
    ):
        names = chain.split()
        for parent, child in itertools.pairwise(names):
            assert OUTPUT_PARENT[child] == parent


def test_canonical_joints_stand_for_output_joints():
    design = {
        "hips": "Hips", "spine": "Spine1", "chest": "Spine2", "neck": "Neck", "head": "Head",
        "left_shoulder": "LeftArm", "left_elbow": "LeftForeArm", "left_wrist": "LeftHand",
        "left_hand": "LeftHandMiddle1", "left_hip": "LeftUpLeg", "left_knee": "LeftLeg",
        "left_ankle": "LeftFoot", "left_toe": "LeftToeBase",
    }  # fmt: skip
    design |= {k.replace("left", "right"): v.replace("Left", "Right") for k, v in design.items()}
    assert OUTPUT_OF_CANONICAL == design
    assert [OUTPUT_JOINTS[i] for i in OUTPUT_OF_CANONICAL_INDEX] == [design[name] for name in CANONICAL]
    assert [OUTPUT_INDEX[name] for name in OUTPUT_JOINTS] == list(range(52))


def test_measured_joints_are_those_of_the_design():
    parts = ("shoulder", "elbow", "wrist", "hip", "knee", "ankle")
    expected = {"hips", "neck", "head", *(f"{s}_{p}" for s in ("left", "right") for p in parts)}
    assert set(MEASURED_JOINTS) == expected and len(MEASURED_JOINTS) == 15
