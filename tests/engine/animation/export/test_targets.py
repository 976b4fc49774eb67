"""Skeletons of the targets: names, order, axes, and which joint has the performer's path."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from studio.engine.animation.clip.options import ROOT_MOTIONS, TARGETS
from studio.engine.animation.clip.skeleton import LocalMotion, to_file_axes, with_file_axes
from studio.engine.animation.clip.unreal import UNREAL_BONES
from studio.engine.animation.export import ExportOptions, clip
from studio.engine.base.errors import SettingsError
from studio.engine.model.joints import OUTPUT_JOINTS
from studio.engine.model.poses import Poses
from tests.poses_factory import random_poses, t_pose
from tests.refused import refused

_LEFT, _UP, _FORWARD = np.eye(3)


def _axes(motion: LocalMotion, name: str) -> np.ndarray:
    wxyz = motion.rest_rotations_wxyz[motion.joint_names.index(name)]
    return Rotation.from_quat(wxyz, scalar_first=True).as_matrix().T


@pytest.mark.parametrize("target", TARGETS)
def test_every_joint_of_the_performer_is_there_once(target: str) -> None:
    motion = clip(t_pose(2), ExportOptions(target=target))
    assert sorted(role for role in motion.roles if role) == sorted(OUTPUT_JOINTS)
    assert len(set(motion.joint_names)) == len(motion.joint_names)
    assert (motion.parents < np.arange(len(motion.parents))).all() and (motion.parents[1:] >= 0).all()


def test_names() -> None:
    names = {target: dict(_by_role(clip(t_pose(), ExportOptions(target=target)))) for target in TARGETS}
    assert names["mixamo"]["LeftHandIndex1"] == "mixamorig:LeftHandIndex1"
    assert names["vrm"]["Spine2"] == "upperChest" and names["vrm"]["RightToeBase"] == "rightToes"
    assert names["vrm"]["LeftHandThumb1"] == "leftThumbMetacarpal"
    assert names["vrm"]["LeftHandPinky2"] == "leftLittleIntermediate"
    assert names["unreal"]["Hips"] == "pelvis" and names["unreal"]["Spine2"] == "spine_05"
    assert names["unreal"]["RightForeArm"] == "lowerarm_r" and names["unreal"]["LeftToeBase"] == "ball_l"


def _by_role(motion: LocalMotion) -> list[tuple[str, str]]:
    return [(role, name) for role, name in zip(motion.roles, motion.joint_names, strict=True) if role]


def test_mixamo_has_ends() -> None:
    motion = clip(t_pose(), ExportOptions(target="mixamo"))
    assert len(motion.joint_names) == 65
    ends = {"HeadTop_End", "LeftToe_End", "RightToe_End", "LeftHandIndex4", "RightHandThumb4"}
    assert {f"mixamorig:{end}" for end in ends} <= set(motion.joint_names)


def test_unreal_has_the_mannequins_bones_in_their_order() -> None:
    motion = clip(t_pose(), ExportOptions(target="unreal"))
    assert len(motion.joint_names) == 89
    assert motion.joint_names == tuple(bone.name for bone in UNREAL_BONES)
    assert motion.joint_names[:9] == (
        "root",
        "pelvis",
        *(f"spine_0{k}" for k in range(1, 6)),
        "clavicle_l",
        "upperarm_l",
    )
    assert motion.joint_names[-9:] == ("ik_foot_root", "ik_foot_l", "ik_foot_r", "ik_hand_root", "ik_hand_gun",
                                       "ik_hand_l", "ik_hand_r", "interaction", "center_of_mass")  # fmt: skip


def test_unreal_axes() -> None:
    """x along the bone (against it on the right arm and the left leg); y and z as in the mannequin."""
    motion = clip(t_pose(), ExportOptions(target="unreal"))
    for name, x, y in (
        ("root", _LEFT, -_FORWARD), ("pelvis", _UP, -_FORWARD), ("head", _UP, -_FORWARD),
        ("lowerarm_l", _LEFT, -_FORWARD), ("lowerarm_r", _LEFT, _FORWARD),
        ("index_02_l", _LEFT, -_UP), ("index_02_r", _LEFT, _UP),
        ("thigh_l", _UP, -_FORWARD), ("thigh_r", -_UP, _FORWARD),
        ("ball_l", _FORWARD, _UP), ("ball_r", -_FORWARD, -_UP), ("ik_hand_gun", _LEFT, _UP),
    ):  # fmt: skip
        axes = _axes(motion, name)
        assert axes[0] @ x > 0.97 and axes[1] @ y > 0.97, name
        assert np.linalg.det(axes) == pytest.approx(1.0)
    rest = motion.rest_positions_m
    for name, child, sign in (("upperarm_l", "lowerarm_l", 1), ("upperarm_r", "lowerarm_r", -1),
                              ("calf_l", "foot_l", -1), ("calf_r", "foot_r", 1),
                              ("spine_01", "spine_02", 1)):  # fmt: skip
        along = rest[motion.joint_names.index(child)] - rest[motion.joint_names.index(name)]
        assert _axes(motion, name)[0] == pytest.approx(sign * along / np.linalg.norm(along), abs=1e-9)


def test_ik_bones_of_unreal_follow_hands_and_feet() -> None:
    motion = clip(random_poses(np.random.default_rng(3), seconds=0.5), ExportOptions(target="unreal"))
    positions, rotations = _world(motion)
    for ik, bone in (
        ("ik_foot_l", "foot_l"),
        ("ik_hand_gun", "hand_r"),
        ("ik_hand_l", "hand_l"),
        ("ik_hand_r", "hand_r"),
    ):
        a, b = motion.joint_names.index(ik), motion.joint_names.index(bone)
        assert positions[:, a] == pytest.approx(positions[:, b], abs=1e-9)
        assert np.abs((rotations[:, a] * rotations[:, b]).sum(axis=-1)) == pytest.approx(1.0)


@pytest.mark.parametrize("target", TARGETS)
@pytest.mark.parametrize("root_motion", ROOT_MOTIONS)
def test_path(target: str, root_motion: str) -> None:
    poses = random_poses(np.random.default_rng(3), seconds=1, turns_per_s=0.7)
    motion = clip(poses, ExportOptions(target=target, root_motion=root_motion))
    positions, _ = _world(motion)
    hips = motion.roles.index("Hips")
    path = to_file_axes(poses.positions_m[:, 0])
    if root_motion == "in-place":
        assert positions[:, hips][:, [0, 2]] == pytest.approx(np.zeros((61, 2)), abs=1e-9)
        assert positions[:, hips, 1] == pytest.approx(path[:, 1])
    else:
        assert positions[:, hips] == pytest.approx(path)
    if root_motion == "root":
        assert motion.roles[0] == "" and hips > 0
        assert positions[:, 0] == pytest.approx(path * [1, 0, 1])
        turns = Rotation.from_quat(motion.rotations_wxyz[:, hips], scalar_first=True)
        rest = Rotation.from_quat(motion.rest_local_wxyz[hips], scalar_first=True)
        assert np.degrees((turns * rest.inv()).magnitude()).max() < 90  # the turning is in the root
    else:
        assert (0 in motion.positions_m) == (hips == 0)


def test_file_axes_keep_every_joint() -> None:
    motion = clip(random_poses(np.random.default_rng(3), seconds=0.5), ExportOptions(target="unreal"))
    plain = with_file_axes(motion)
    assert plain.rest_positions_m == pytest.approx(motion.rest_positions_m)
    assert _world(plain)[0] == pytest.approx(_world(motion)[0])


def test_a_skeleton_without_hips_is_refused_by_targets_only() -> None:
    poses = t_pose(2)
    other = Poses(poses.time_s, ("Pelvis", *poses.joint_names[1:]), poses.parents, poses.positions_m,
                  poses.rotations_wxyz, poses.confidence, poses.uncertainty_mm)  # fmt: skip
    assert clip(other, ExportOptions()).joint_names[0] == "Pelvis"
    for options in (ExportOptions(target="unreal"), ExportOptions(root_motion="root")):
        with refused(SettingsError, "export.no_hips"):
            clip(other, options)


def _world(motion: LocalMotion) -> tuple[np.ndarray, np.ndarray]:
    from studio.engine.animation.clip.kinematics import world_poses

    return world_poses(motion.parents, motion.local_positions_m(), motion.rotations_wxyz)
