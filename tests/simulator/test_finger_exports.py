"""Followed fingers keep their angles in exported files of animation programs."""

from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from studio.engine.animation.export import export
from studio.engine.animation.mannequin.performer import Mannequin
from studio.engine.animation.motion.motion import Motion
from studio.engine.animation.read.files import read_animation
from studio.engine.base.geometry import matrices
from studio.engine.model.joints import OUTPUT_INDEX, OUTPUT_JOINTS
from studio.engine.model.poses import Poses
from studio.engine.model.settings.settings import parse_settings
from studio.engine.whole_take.take import solve_frames
from studio.streams.unity import unity_pose
from tests.engine.animation.export.test_glb import glb_pose
from tests.simulator.finger_figures import seen_stage

CHAINS = [
    [f"{side}Hand", *(f"{side}Hand{finger}{k}" for k in (1, 2, 3))]
    for side in ("Left", "Right")
    for finger in ("Index", "Middle", "Ring", "Pinky")
]


@pytest.fixture(scope="module")
def poses() -> Poses:
    stage = seen_stage(3.0, seed=12)
    return solve_frames(stage.frames, stage.calibration, parse_settings("finish"))


def bends(positions_m: NDArray[np.float64], names: dict[str, int]) -> NDArray[np.float64]:
    """Angles between the bones of each finger [rad], shape (F, fingers, 2): independent of axes and units."""
    out = []
    for chain in CHAINS:
        bones = np.diff(positions_m[:, [names[name] for name in chain]], axis=1)
        bones /= np.linalg.norm(bones, axis=-1, keepdims=True)
        out.append(np.arccos(np.clip(np.vecdot(bones[:, 1:], bones[:, :-1]), -1.0, 1.0)))
    return np.stack(out, axis=1)


def test_a_glb_holds_the_bends_of_every_finger(poses: Poses, tmp_path: Path) -> None:
    export(poses, tmp_path / "take.glb", "glb")
    world, _, _ = glb_pose(tmp_path / "take.glb", poses.time_s - poses.time_s[0])
    found = np.stack([world[name][0] for name in OUTPUT_JOINTS], axis=1)
    assert np.abs(bends(found, OUTPUT_INDEX) - bends(poses.positions_m, OUTPUT_INDEX)).max() < 0.02


def test_usd_holds_the_bends_of_every_finger(poses: Poses, tmp_path: Path) -> None:
    usd, skel = (pytest.importorskip(f"pxr.{part}", reason="usd-core") for part in ("Usd", "UsdSkel"))
    export(poses, tmp_path / "take.usdc", "usd")
    stage, cache = usd.Stage.Open(str(tmp_path / "take.usdc")), skel.Cache()
    cache.Populate(skel.Root(stage.GetPrimAtPath("/Performer")), usd.PrimDefaultPredicate)
    query = cache.GetSkelQuery(skel.Skeleton(stage.GetPrimAtPath("/Performer/Skeleton")))
    own = bends(poses.positions_m, OUTPUT_INDEX)
    for frame in range(0, len(own), 20):
        found = np.array(query.ComputeJointSkelTransforms(usd.TimeCode(frame)))[None, :, 3, :3]
        assert np.abs(bends(found, OUTPUT_INDEX)[0] - own[frame]).max() < 0.02


def test_live_streams_hold_the_turns_of_every_finger(poses: Poses) -> None:
    turns = matrices(poses.rotations_wxyz)
    for frame in range(0, len(turns), 20):
        sent = unity_pose(0.0, poses.positions_m[frame], poses.rotations_wxyz[frame])
        for chain in CHAINS:
            for parent, child in pairwise(chain):
                joint = OUTPUT_INDEX[child]
                local = turns[frame, OUTPUT_INDEX[parent]].T @ turns[frame, joint]
                angle = 2.0 * np.arccos(min(1.0, abs(float(sent.local_rotations_wxyz[joint, 0]))))
                assert angle == pytest.approx(Rotation.from_matrix(local).magnitude(), abs=1e-3)


def test_the_mannequin_moves_its_fingers(poses: Poses) -> None:
    own = bends(poses.positions_m, OUTPUT_INDEX)
    row = int(np.argmax(own.sum(axis=(1, 2))))
    straight = poses.rotations_wxyz[row].copy()
    for hand, *fingers in CHAINS:
        straight[[OUTPUT_INDEX[name] for name in fingers]] = straight[OUTPUT_INDEX[hand]]
    mannequin = Mannequin.of(poses)
    bent, _ = mannequin.posed(poses.positions_m[row], poses.rotations_wxyz[row])
    flat, _ = mannequin.posed(poses.positions_m[row], straight)
    assert np.linalg.norm(bent - flat, axis=1).max() > 0.005


@pytest.mark.parametrize("format", ["bvh", "fbx"])
def test_a_file_holds_the_bends_of_every_finger(poses: Poses, tmp_path: Path, format: str) -> None:
    own = bends(poses.positions_m, OUTPUT_INDEX)
    assert np.ptp(own, axis=0).max() > 0.5  # they move
    export(poses, tmp_path / f"take.{format}", format)
    motion = read_animation(tmp_path / f"take.{format}")
    assert isinstance(motion, Motion)
    found = bends(motion.positions_m, {name: k for k, name in enumerate(motion.joint_names)})
    assert np.abs(found[-len(own) :] - own).max() < 0.01
