"""BVH files as bvhio reads them."""

from pathlib import Path

import numpy as np
import pytest

from studio.engine.animation.clip.skeleton import to_file_axes
from studio.engine.animation.export import export
from studio.engine.model.poses import Poses
from tests.engine.animation.export.readers.programs import read_with_bvhio
from tests.engine.animation.export.scoring import HARD_MOTIONS, rotation_error_deg
from tests.poses_factory import random_poses, rest_offsets_m, t_pose


@pytest.mark.parametrize("motion", HARD_MOTIONS)
def test_world_joints_read_back(tmp_path: Path, motion: str) -> None:
    poses = random_poses(np.random.default_rng(2), seconds=2, hz=60, **HARD_MOTIONS[motion])
    export(poses, tmp_path / "take.bvh", "bvh")
    back = read_with_bvhio(tmp_path / "take.bvh")
    assert back.names == poses.joint_names  # depth first, like the output skeleton
    assert back.parents == tuple(poses.parents)
    assert back.scene["frames_per_second"] == pytest.approx(60.0, rel=1e-6)
    assert np.abs(back.positions_cm - to_file_axes(poses.positions_m) * 100).max() < 0.002
    assert rotation_error_deg(back, poses) < 0.01


def test_rest_is_the_t_pose(tmp_path: Path) -> None:
    export(t_pose(2), tmp_path / "take.bvh", "bvh")
    text = (tmp_path / "take.bvh").read_text()
    back = read_with_bvhio(tmp_path / "take.bvh")
    offsets = back.rest_cm[1:] - back.rest_cm[list(back.parents[1:])]
    assert offsets == pytest.approx(to_file_axes(rest_offsets_m())[1:] * 100, abs=1e-4)
    rotations = np.array(text.splitlines()[-1].split(), dtype=float)[3:]
    assert rotations == pytest.approx(np.zeros(52 * 3))
    assert text.count("End Site") == 13
    assert text.count("CHANNELS 3 Zrotation Xrotation Yrotation") == 51


def test_channels_follow_the_hierarchy_when_joints_are_listed_in_another_order(tmp_path: Path) -> None:
    poses = random_poses(np.random.default_rng(2), seconds=1)
    order = sorted(range(52), key=lambda j: (_depth(poses, j), j))  # breadth first: parents still come first
    shuffled = Poses(
        time_s=poses.time_s,
        joint_names=tuple(poses.joint_names[j] for j in order),
        parents=np.array([-1 if poses.parents[j] < 0 else order.index(poses.parents[j]) for j in order]),
        positions_m=poses.positions_m[:, order],
        rotations_wxyz=poses.rotations_wxyz[:, order],
        confidence=poses.confidence[:, order],
        uncertainty_mm=poses.uncertainty_mm[:, order],
    )
    export(shuffled, tmp_path / "take.bvh", "bvh")
    back = read_with_bvhio(tmp_path / "take.bvh").in_order(shuffled.joint_names)
    assert back.parents == tuple(shuffled.parents)
    assert np.abs(back.positions_cm - to_file_axes(shuffled.positions_m) * 100).max() < 0.002


def test_rate_is_resampled(tmp_path: Path) -> None:
    poses = random_poses(np.random.default_rng(2), seconds=2, hz=120)
    export(poses, tmp_path / "take.bvh", "bvh", fps=30)
    back = read_with_bvhio(tmp_path / "take.bvh")
    assert back.scene["frames_per_second"] == pytest.approx(30.0, rel=1e-6)
    assert np.abs(back.positions_cm - to_file_axes(poses.positions_m[::4]) * 100).max() < 0.002


def _depth(poses: Poses, joint: int) -> int:
    depth = 0
    while poses.parents[joint] >= 0:
        joint, depth = poses.parents[joint], depth + 1
    return depth
