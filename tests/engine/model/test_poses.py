"""Poses: saved and loaded completely, and refused if incomplete."""

from dataclasses import replace

import numpy as np
import pytest

from studio.engine.base.errors import FormatError
from studio.engine.model.poses import Poses
from tests.poses_factory import random_poses, t_pose
from tests.refused import refused


@pytest.fixture
def poses():
    return random_poses(np.random.default_rng(1), seconds=0.3)


def test_they_round_trip(tmp_path, poses):
    poses.save(tmp_path / "poses.npz")
    back = Poses.load(tmp_path / "poses.npz")
    assert back.joint_names == poses.joint_names
    for name in ("time_s", "parents", "positions_m", "rotations_wxyz", "confidence", "uncertainty_mm"):
        assert np.array_equal(getattr(back, name), getattr(poses, name), equal_nan=True), name


def test_the_file_holds_the_keys_of_the_contract(tmp_path, poses):
    poses.save(tmp_path / "poses.npz")
    with np.load(tmp_path / "poses.npz", allow_pickle=False) as data:
        shapes = {key: data[key].shape for key in data.files}
    frames, joints = poses.frame_count, 52
    assert shapes.pop("format_version") == ()
    assert shapes == {
        "time_s": (frames,), "joint_names": (joints,), "parents": (joints,), "positions_m": (frames, joints, 3),
        "rotations_wxyz": (frames, joints, 4), "confidence": (frames, joints), "uncertainty_mm": (frames, joints),
    }  # fmt: skip


def test_frame_rate(poses):
    assert poses.frames_per_second == pytest.approx(60.0)
    assert t_pose(1).frames_per_second == 60.0


@pytest.mark.parametrize("name", ["parents", "positions_m", "rotations_wxyz", "confidence", "uncertainty_mm"])
def test_wrong_shapes_are_refused_by_name(poses, name):
    with refused(FormatError, "poses.shape", name=name):
        replace(poses, **{name: getattr(poses, name)[:-1]})


def test_what_is_not_finite_or_not_a_tree_is_refused(poses):
    positions = poses.positions_m.copy()
    positions[0, 0, 0] = np.nan
    with refused(FormatError, "poses.not_finite"):
        replace(poses, positions_m=positions)
    parents = poses.parents.copy()
    parents[3] = 3
    with refused(FormatError, "poses.parents"):
        replace(poses, parents=parents)


def test_a_missing_broken_or_other_file_is_told(tmp_path, poses):
    with refused(FormatError, "poses.none"):
        Poses.load(tmp_path / "none.npz")
    path = tmp_path / "poses.npz"
    poses.save(path)
    whole = path.read_bytes()
    for size in (0, 10, len(whole) // 2, len(whole) - 5):
        path.write_bytes(whole[:size])
        with refused(FormatError, "poses.not_npz", "poses.damaged"):
            Poses.load(path)
    path.write_bytes(b"not a file of numpy at all" * 100)
    with refused(FormatError, "poses.not_npz"):
        Poses.load(path)
    spoiled = bytearray(whole)
    spoiled[len(whole) // 3 : len(whole) // 3 + 40] = bytes(40)
    path.write_bytes(bytes(spoiled))
    with refused(FormatError, "poses.damaged"):
        Poses.load(path)
    with path.open("wb") as file:
        np.savez(file, time_s=np.zeros(3))
    with refused(FormatError, "poses.not_npz", error="'joint_names'"):
        Poses.load(path)


def test_no_code_is_run_from_a_file(tmp_path, poses):
    path = tmp_path / "poses.npz"
    with path.open("wb") as file:
        np.savez(file, time_s=np.array([{"an": "object"}], dtype=object))
    with pytest.raises(FormatError):
        Poses.load(path)
