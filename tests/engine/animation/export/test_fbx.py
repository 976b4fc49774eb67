"""FBX files as the Autodesk FBX SDK and ufbx read them."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from studio.engine.animation.clip.skeleton import local_motion, to_file_axes
from studio.engine.animation.export import export
from studio.engine.animation.export.fbx import writer as fbx
from studio.engine.base.errors import SettingsError
from studio.engine.model.poses import Poses
from tests.engine.animation.export.readers.programs import ReadBack, read_with_fbx_sdk, read_with_ufbx
from tests.engine.animation.export.scoring import HARD_MOTIONS, position_error_cm, rotation_error_deg
from tests.poses_factory import random_poses, t_pose

READERS = [read_with_fbx_sdk, read_with_ufbx]
Reader = Callable[..., ReadBack]

_POSITIVE_Y, _POSITIVE_Z = 2, 4  # ufbx's numbers of axes


@pytest.mark.parametrize("reader", READERS)
@pytest.mark.parametrize("motion", HARD_MOTIONS)
def test_world_joints_at_keys(tmp_path: Path, motion: str, reader: Reader) -> None:
    poses = random_poses(np.random.default_rng(2), seconds=3, hz=60, **HARD_MOTIONS[motion])
    export(poses, tmp_path / "take.fbx", "fbx")
    back = reader(tmp_path / "take.fbx", hz=60).in_order(poses.joint_names)
    assert back.parents == tuple(poses.parents)
    assert back.scene["end_s"] == pytest.approx(3.0)
    assert position_error_cm(back, poses).max() < 0.002
    assert rotation_error_deg(back, poses) < 0.01


@pytest.mark.parametrize(
    ("motion", "reader"),
    [
        ("lively", read_with_fbx_sdk),
        *((motion, read_with_ufbx) for motion in ("turning", "arms forward", "bones vary")),
        pytest.param("lively", read_with_ufbx, marks=pytest.mark.long),
        *(
            pytest.param(motion, read_with_fbx_sdk, marks=pytest.mark.long)
            for motion in ("turning", "arms forward", "bones vary")
        ),
    ],
)
def test_cubic_keys_follow_the_motion_between_them(tmp_path: Path, motion: str, reader: Reader) -> None:
    poses = random_poses(np.random.default_rng(7), seconds=2, hz=120, **HARD_MOTIONS[motion])
    at_60_hz = _every_second_frame(poses)
    mean = {}
    for interpolation in ("cubic", "linear", "constant"):
        export(poses, tmp_path / "take.fbx", "fbx", fps=30, interpolation=interpolation)
        error = position_error_cm(reader(tmp_path / "take.fbx", hz=60), at_60_hz)
        assert error[::2].max() < 0.002
        mean[interpolation] = error[1::2].mean()
        if interpolation == "cubic":
            assert error.max() < 0.5
    assert mean["cubic"] < 0.1
    assert 3 * mean["cubic"] < mean["linear"] < mean["constant"] / 3


def test_one_rotation_order_for_all_would_fail_with_the_arms_forward(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    poses = random_poses(np.random.default_rng(7), seconds=4, hz=120, **HARD_MOTIONS["arms forward"])
    worst = {}
    for name in ("best", "usual"):
        if name == "usual":
            monkeypatch.setattr(fbx, "best_order", lambda rotations: "ZYX")
        export(poses, tmp_path / "take.fbx", "fbx", fps=30)
        error = position_error_cm(read_with_ufbx(tmp_path / "take.fbx", hz=60), _every_second_frame(poses))
        worst[name] = error.max()
    assert 2 * worst["best"] < worst["usual"]


def test_scene_is_y_up_facing_z_in_centimetres_with_every_bone_in_the_bind_pose(tmp_path: Path) -> None:
    poses = random_poses(np.random.default_rng(2), seconds=1)
    export(poses, tmp_path / "take.fbx", "fbx")
    scene = read_with_ufbx(tmp_path / "take.fbx", hz=60).scene
    assert scene["unit_m"] == 0.01
    assert (scene["up"], scene["front"]) == (_POSITIVE_Y, _POSITIVE_Z)
    assert scene["bind_bones"] == 52
    assert scene["cubic"] == scene["curves"] == 53 * 3


@pytest.mark.parametrize("reader", READERS)
def test_rest_is_the_t_pose(tmp_path: Path, reader: Reader) -> None:
    poses = random_poses(np.random.default_rng(2), seconds=1)
    export(poses, tmp_path / "take.fbx", "fbx")
    rest = reader(tmp_path / "take.fbx", hz=60).in_order(poses.joint_names).rest_cm
    assert rest == pytest.approx(local_motion(poses).rest_positions_m * 100, abs=0.001)
    standing = to_file_axes(t_pose().positions_m[0]) * 100
    assert rest - rest[0] == pytest.approx(standing - standing[0], abs=0.001)


@pytest.mark.parametrize("fps", [24, 25, 30, 30 / 1.001, 50, 60 / 1.001, 75, 120])
def test_frame_rate(tmp_path: Path, fps: float) -> None:
    export(random_poses(np.random.default_rng(2), seconds=1, hz=120), tmp_path / "take.fbx", "fbx", fps=fps)
    scene = read_with_ufbx(tmp_path / "take.fbx", hz=1).scene
    assert scene["frames_per_second"] == pytest.approx(fps, rel=1e-5)
    assert scene["end_s"] == pytest.approx(int(fps + 1e-6) / fps)


@pytest.mark.parametrize("reader", READERS)
@pytest.mark.parametrize("frames", [2, 3, 4])
def test_short_takes(tmp_path: Path, frames: int, reader: Reader) -> None:
    poses = _frames(random_poses(np.random.default_rng(2), seconds=1, hz=60), slice(frames))
    export(poses, tmp_path / "take.fbx", "fbx")
    assert position_error_cm(reader(tmp_path / "take.fbx", hz=60), poses).max() < 0.002


def test_one_frame(tmp_path: Path) -> None:
    export(t_pose(), tmp_path / "take.fbx", "fbx")
    assert position_error_cm(read_with_ufbx(tmp_path / "take.fbx", hz=60), t_pose()).max() < 0.002


def test_time_starts_at_zero(tmp_path: Path) -> None:
    poses = random_poses(np.random.default_rng(2), seconds=1)
    export(replace(poses, time_s=poses.time_s + 100.0), tmp_path / "take.fbx", "fbx")
    assert read_with_ufbx(tmp_path / "take.fbx", hz=1).scene["begin_s"] == 0.0


def test_same_poses_same_bytes(tmp_path: Path) -> None:
    poses = random_poses(np.random.default_rng(2), seconds=1)
    for name in ("a.fbx", "b.fbx"):
        export(poses, tmp_path / name, "fbx")
    assert (tmp_path / "a.fbx").read_bytes() == (tmp_path / "b.fbx").read_bytes()


@pytest.mark.parametrize("option", [{"interpolation": "spline"}, {"take_name": ""}, {"take_name": "a\x00b"}])
def test_unknown_values_are_refused(tmp_path: Path, option: dict[str, str]) -> None:
    with pytest.raises(SettingsError):
        export(t_pose(), tmp_path / "take.fbx", "fbx", **option)
    assert not list(tmp_path.iterdir())


def _frames(poses: Poses, frames: slice) -> Poses:
    keys = ("time_s", "positions_m", "rotations_wxyz", "confidence", "uncertainty_mm")
    return replace(poses, **{key: getattr(poses, key)[frames] for key in keys})


def _every_second_frame(poses: Poses) -> Poses:
    return _frames(poses, slice(None, None, 2))
