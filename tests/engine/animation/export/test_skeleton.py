"""Poses as rest skeleton and local keys."""

from dataclasses import replace

import numpy as np
import pytest

from studio.engine.animation.clip.resample import standard_rate
from studio.engine.animation.clip.skeleton import end_sites, local_motion, to_file_axes
from studio.engine.base.errors import FormatError, SettingsError
from studio.engine.model.joints import OUTPUT_INDEX
from tests.poses_factory import random_poses, rest_offsets_m, t_pose
from tests.refused import refused


def test_offsets_and_rest_are_the_t_pose() -> None:
    motion = local_motion(random_poses(np.random.default_rng(1), seconds=1))
    assert motion.offsets_m[1:] == pytest.approx(to_file_axes(rest_offsets_m())[1:], abs=1e-9)
    assert list(motion.positions_m) == [0]
    rest = motion.rest_positions_m
    assert rest[OUTPUT_INDEX["LeftHand"], 0] > 0.5  # the left hand at +x
    assert rest[OUTPUT_INDEX["LeftToeBase"], 2] > rest[OUTPUT_INDEX["LeftFoot"], 2] + 0.1  # facing +z
    assert rest[:, 1].min() == pytest.approx(0.02)  # y up, on the floor


def test_t_pose_has_zero_rotations() -> None:
    motion = local_motion(t_pose(3))
    assert motion.rotations_wxyz == pytest.approx(np.broadcast_to([1.0, 0, 0, 0], (3, 52, 4)))


def test_only_bones_that_vary_get_position_keys() -> None:
    poses = random_poses(np.random.default_rng(1), seconds=1)
    hand = OUTPUT_INDEX["LeftHandPinky3"]
    poses.positions_m[10, hand] += [0.0, 0.0, 0.001]
    assert sorted(local_motion(poses).positions_m) == [0, hand]
    poses = random_poses(np.random.default_rng(1), seconds=1, offset_sd_m=0.01)
    assert sorted(local_motion(poses).positions_m) == list(range(52))


def test_input_is_not_changed() -> None:
    poses = random_poses(np.random.default_rng(1), seconds=1)
    for array in (poses.positions_m, poses.rotations_wxyz, poses.time_s):
        array.setflags(write=False)
    local_motion(poses, fps=24)


@pytest.mark.parametrize("fps", [24.0, 30.0, 48.0, 120.0, 30 / 1.001])
def test_resampling_follows_the_motion(fps: float) -> None:
    poses = random_poses(np.random.default_rng(3), seconds=2, hz=60, cutoff_hz=1.0)
    motion = local_motion(poses, fps=fps)
    assert motion.frames_per_second == pytest.approx(fps)
    assert motion.frame_count == int(2 * fps + 1e-6) + 1
    assert np.linalg.norm(motion.rotations_wxyz, axis=-1) == pytest.approx(np.ones((motion.frame_count, 52)))
    assert np.abs(np.diff(motion.rotations_wxyz, axis=0)).max() < 0.5


def test_doubling_the_rate_matches_the_motion_between_frames() -> None:
    slow, fast = (
        local_motion(random_poses(np.random.default_rng(5), seconds=2, hz=hz), fps=120) for hz in (60, 120)
    )
    inner = slice(2, -2)
    dots = np.abs((slow.rotations_wxyz * fast.rotations_wxyz).sum(axis=-1))[inner]
    assert np.degrees(2 * np.arccos(np.minimum(dots, 1.0))).max() < 0.05
    assert np.abs(slow.positions_m[0] - fast.positions_m[0])[inner].max() < 1e-4


def test_uneven_times_are_brought_to_the_grid() -> None:
    poses = random_poses(np.random.default_rng(5), seconds=2, hz=60)
    keep = np.setdiff1d(np.arange(121), [40, 41, 77])
    gaps = replace(
        poses,
        **{
            key: getattr(poses, key)[keep]
            for key in ("time_s", "positions_m", "rotations_wxyz", "confidence", "uncertainty_mm")
        },
    )
    motion, truth = local_motion(gaps), local_motion(poses)
    assert motion.frame_count == 121
    assert np.abs(motion.positions_m[0] - truth.positions_m[0]).max() < 0.01


def test_times_that_start_late_and_round_to_nanoseconds_are_kept() -> None:
    poses = random_poses(np.random.default_rng(5), seconds=2, hz=60)
    stamped = replace(poses, time_s=np.round(poses.time_s + 1234.5, 9))
    motion = local_motion(stamped)
    assert motion.frames_per_second == 60.0
    assert motion.positions_m[0] == pytest.approx(to_file_axes(poses.positions_m[:, 0]), abs=1e-12)


@pytest.mark.parametrize(
    ("rate", "standard"),
    [(59.9999988, 60.0), (29.97, 30 / 1.001), (23.976, 24 / 1.001), (12.34, 12.34)],
)
def test_standard_rate(rate: float, standard: float) -> None:
    assert standard_rate(rate) == pytest.approx(standard, rel=1e-4)


def test_every_leaf_ends_somewhere_sensible() -> None:
    motion = local_motion(t_pose())
    ends = end_sites(motion)
    names = {motion.joint_names[joint]: end for joint, end in ends.items()}
    assert len(names) == 13
    assert 0.14 < names["Head"][1] < 0.22
    assert names["LeftToeBase"] == pytest.approx([0.0, 0.0, names["LeftToeBase"][2]])
    assert 0.04 < names["LeftToeBase"][2] < 0.1
    assert names["LeftHandIndex3"][0] > 0.02 and names["RightHandIndex3"][0] < -0.02


@pytest.mark.parametrize("fps", [0.0, -30.0, float("nan"), float("inf"), 5000.0])
def test_impossible_rates_are_refused(fps: float) -> None:
    with refused(SettingsError, "export.fps"):
        local_motion(t_pose(3), fps=fps)


def test_poses_that_cannot_be_exported_are_refused() -> None:
    poses = t_pose(3)
    with refused(FormatError, "export.no_frame"):
        local_motion(t_pose(0))
    with refused(FormatError, "export.roots"):
        local_motion(replace(poses, parents=np.where(poses.parents == 3, -1, poses.parents)))
    with refused(FormatError, "export.no_rotation"):
        local_motion(replace(poses, rotations_wxyz=np.zeros_like(poses.rotations_wxyz)))
    with refused(FormatError, "export.times"):
        local_motion(replace(poses, time_s=np.zeros(3)))
