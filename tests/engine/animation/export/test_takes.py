"""Several takes in one FBX, and takes with a time of day."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from studio.engine.animation.clip.timecode import timecode_seconds
from studio.engine.animation.export import ExportOptions, export, export_takes
from studio.engine.base.errors import SettingsError
from studio.engine.model.poses import Poses
from tests.engine.animation.export.readers.programs import (
    read_with_blender,
    read_with_fbx_sdk,
    read_with_ufbx,
)
from tests.engine.animation.export.scoring import position_error_cm
from tests.poses_factory import make_poses, random_poses, rest_offsets_m
from tests.refused import refused


def _takes() -> list[Poses]:
    """Two takes of a performer, and one of another, whose bones are 4 % longer."""
    first, second, third = (random_poses(np.random.default_rng(k), seconds=0.5 + 0.25 * k) for k in range(3))
    local = np.tile([1.0, 0.0, 0.0, 0.0], (third.frame_count, 52, 1))
    tall = make_poses(local, root_m=third.positions_m[:, 0], offsets_m=1.04 * rest_offsets_m())
    return [first, second, tall]


def test_each_take_is_a_stack_of_its_own(tmp_path: Path) -> None:
    takes = [(poses, ExportOptions(take_name=name)) for poses, name in zip(_takes(), "aba", strict=True)]
    export_takes(takes, tmp_path / "takes.fbx", "fbx")
    for k, (poses, _) in enumerate(takes):
        back = read_with_ufbx(tmp_path / "takes.fbx", hz=60, take=k)
        assert back.scene["takes"] == 3
        assert position_error_cm(back, poses).max() < 0.01
    assert (tmp_path / "takes.fbx").read_bytes().count(b"a 2\x00\x01AnimStack") == 1


def test_blender_sees_all_takes(tmp_path: Path) -> None:
    takes = [(poses, ExportOptions(take_name=name)) for poses, name in zip(_takes(), "abc", strict=True)]
    export_takes(takes, tmp_path / "takes.fbx", "fbx")
    scenes = read_with_blender({"takes": {"file": tmp_path / "takes.fbx", "frames": [0]}}, tmp_path)
    assert len(scenes["takes"].actions) == 3


def test_takes_that_do_not_go_into_one_file_are_refused(tmp_path: Path) -> None:
    poses, other, _ = _takes()
    with refused(SettingsError, "export.other_rate", fps=60):
        export_takes([(poses, ExportOptions(fps=30)), (other, ExportOptions(fps=60))], tmp_path / "x", "fbx")
    fewer = replace(other, joint_names=(*other.joint_names[:-1], "Tail"))
    with refused(SettingsError, "export.other_joints"):
        export_takes([(poses, ExportOptions()), (fewer, ExportOptions())], tmp_path / "x", "fbx")
    with refused(SettingsError, "export.one_take_format", allowed="fbx, otio"):
        export_takes([(poses, ExportOptions()), (other, ExportOptions())], tmp_path / "x", "bvh")
    assert not list(tmp_path.iterdir())


def test_keys_begin_at_the_time_of_day(tmp_path: Path) -> None:
    poses, _, _ = _takes()
    export(poses, tmp_path / "x.fbx", "fbx", timecode="23:59:58:30", start_s=0.25)
    back = read_with_ufbx(tmp_path / "x.fbx", hz=60)
    begin = 86398.5 + 0.25
    assert (back.scene["begin_s"], back.scene["end_s"]) == pytest.approx((begin, begin + 0.25), abs=1e-9)
    late = read_with_fbx_sdk(tmp_path / "x.fbx", hz=60)
    assert len(late.positions_cm) == 16


def test_timecodes() -> None:
    assert timecode_seconds("01:00:00:12", 24.0) == 3600.5
    assert timecode_seconds("00:00:01:00", 30 / 1.001) == pytest.approx(1.001)
    for wrong in ("1:0:0:0", "24:00:00:00", "00:60:00:00", "00:00:00:25", "00:00:00"):
        with refused(SettingsError, "export.timecode", "export.timecode_range"):
            timecode_seconds(wrong, 25.0)


def test_progress_rises_to_the_end(tmp_path: Path) -> None:
    shares: list[float] = []
    poses, _, _ = _takes()
    export(poses, tmp_path / "x.fbx", "fbx", progress=shares.append)
    assert shares == sorted(shares) and shares[-1] == 1.0 and len(shares) > 20
