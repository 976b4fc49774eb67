"""Motions on rigs of other proportions: feet still and on the floor, no limb bent the wrong way."""

from pathlib import Path

import numpy as np
import pytest

from studio.engine.animation.clip.kinematics import world_poses
from studio.engine.animation.clip.skeleton import LocalMotion
from studio.engine.animation.export import ExportOptions, clip
from studio.engine.animation.retarget.onto import open_rig
from studio.engine.animation.retarget.transfer import retargeted
from studio.engine.base.errors import SettingsError
from studio.engine.model.poses import Poses
from tests.engine.animation.retarget.performers import squatting
from tests.engine.animation.retarget.rigs import BODIES, write_rig
from tests.poses_factory import t_pose
from tests.refused import refused

LIMBS = [(s + a, s + b, s + c) for s in ("Left", "Right")
         for a, b, c in (("UpLeg", "Leg", "Foot"), ("Arm", "ForeArm", "Hand"))]  # fmt: skip


def places(motion: LocalMotion) -> dict[str, np.ndarray]:
    """World positions by role, or by name where a bone has none [m]."""
    world, _ = world_poses(motion.parents, motion.local_positions_m(), motion.rotations_wxyz)
    return {role or motion.joint_names[j]: world[:, j] for j, role in enumerate(motion.roles)}


def onto(path: Path, poses: Poses, root_motion: str = "hips") -> LocalMotion:
    return retargeted(clip(poses, ExportOptions()), open_rig(path).mapping, root_motion)


def bends(at: dict[str, np.ndarray], limb: tuple[str, str, str]) -> np.ndarray:
    a, b, c = (at[name] for name in limb)
    return np.cross(b - a, c - b)


@pytest.mark.parametrize(
    "name", ["humanik.glb", "vrm.glb", "unreal.glb", "humanik.bvh", "mixamo.bvh", "mixamo.fbx", "unreal.fbx"]
)
def test_onto_the_same_rig_it_is_the_plain_export(name: str, tmp_path: Path) -> None:
    if name.endswith("fbx"):
        pytest.importorskip("ufbx")
    poses, target = squatting(), name.split(".")[0]
    got = places(onto(write_rig(tmp_path / name, t_pose(2), target), poses))
    wanted = places(clip(poses, ExportOptions(target=target)))
    for role in clip(poses, ExportOptions()).roles:
        assert np.abs(got[role] - wanted[role]).max() < 1e-5, role


@pytest.mark.parametrize("a_pose", [False, True])
@pytest.mark.parametrize("body", BODIES)
def test_feet_stand_and_limbs_bend_as_the_performers(body: str, a_pose: bool, tmp_path: Path) -> None:
    poses = squatting()
    motion = onto(write_rig(tmp_path / "rig.glb", t_pose(2), "unreal", body, a_pose), poses)
    at, rest = places(motion), dict(zip(motion.roles, motion.rest_positions_m, strict=True))
    source = places(clip(poses, ExportOptions()))
    for foot in ("LeftFoot", "LeftToeBase", "RightFoot", "RightToeBase"):
        assert np.abs(at[foot][:, 1] - rest[foot][1]).max() < 0.01
        assert np.ptp(at[foot], axis=0).max() < 0.002
    for limb in LIMBS:
        mine, theirs = bends(at, limb), bends(source, limb)
        bent = np.linalg.norm(theirs, axis=1) > 0.005
        cosine = (mine * theirs).sum(1) / np.linalg.norm(mine, axis=1) / np.linalg.norm(theirs, axis=1)
        assert bent.any() and cosine[bent].min() > 0.7, limb
    for up, low in (("UpLeg", "Leg"), ("Leg", "Foot"), ("Arm", "ForeArm"), ("ForeArm", "Hand")):
        length = np.linalg.norm(at["Left" + low] - at["Left" + up], axis=1)
        assert np.ptp(length) < 1e-6


@pytest.mark.parametrize("target", ["humanik", "mixamo", "vrm", "unreal"])
def test_an_a_pose_makes_no_difference(target: str, tmp_path: Path) -> None:
    poses = squatting(31)
    straight, hanging = (
        places(onto(write_rig(tmp_path / f"{a}.glb", t_pose(2), target, "child", a), poses))
        for a in (False, True)
    )
    for role in clip(poses, ExportOptions()).roles:
        assert np.abs(straight[role] - hanging[role]).max() < 1e-4, role


def test_feet_that_float_are_put_down(tmp_path: Path) -> None:
    rig = write_rig(tmp_path / "rig.glb", t_pose(2))
    motion = onto(rig, squatting(lift_m=0.03))
    at, rest = places(motion), dict(zip(motion.roles, motion.rest_positions_m, strict=True))
    assert np.abs(at["LeftToeBase"][:, 1] - rest["LeftToeBase"][1]).max() < 0.0051
    assert places(clip(squatting(lift_m=0.03), ExportOptions()))["LeftToeBase"][:, 1].min() > 0.049


def test_hands_that_meet_do_so_on_long_arms(tmp_path: Path) -> None:
    poses = squatting()
    source = places(clip(poses, ExportOptions()))
    at = places(onto(write_rig(tmp_path / "rig.glb", t_pose(2), "humanik", "long arms"), poses))
    apart = np.linalg.norm(source["LeftHand"] - source["RightHand"], axis=1)
    close = int(apart.argmin())
    assert apart[close] < 0.15
    assert np.linalg.norm(at["LeftHand"] - at["RightHand"], axis=1)[close] < 1.6 * apart[close]


def test_root_motion(tmp_path: Path) -> None:
    poses = squatting()
    moved = Poses(
        **{
            **poses.__dict__,
            "positions_m": poses.positions_m + np.linspace(0, 2, 61)[:, None, None] * [1, 0, 0],
        }
    )
    rig = write_rig(tmp_path / "rig.glb", t_pose(2), "unreal", "child")
    hips, root, still = (places(onto(rig, moved, way)) for way in ("hips", "root", "in-place"))
    assert np.allclose(hips["Hips"], root["Hips"], atol=1e-9) and np.ptp(hips["root"]) == 0
    assert np.allclose(root["root"][:, 0], root["Hips"][:, 0]) and np.ptp(root["root"][:, 1]) == 0
    assert np.allclose(root["ik_foot_root"], root["root"])
    assert np.ptp(still["Hips"][:, 0]) < 1e-9 and np.allclose(still["Hips"][:, 1], hips["Hips"][:, 1])
    with refused(SettingsError, "rig.no_root_bone"):
        onto(write_rig(tmp_path / "other.glb", t_pose(2)), poses, "root")
