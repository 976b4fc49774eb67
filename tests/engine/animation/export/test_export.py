"""The registry of exporters: its formats, what it refuses, and that no files are left behind."""

import errno
import os
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest

from studio.engine.animation.export import EXPORTERS, export
from studio.engine.base.errors import FormatError, SettingsError, StudioError
from tests.poses_factory import random_poses, t_pose
from tests.refused import refused

NO_USD = pytest.mark.skipif(find_spec("pxr") is None, reason="usd-core is not installed")
FORMATS = [pytest.param(name, marks=NO_USD if name == "usd" else ()) for name in EXPORTERS]


@pytest.mark.parametrize("format", FORMATS)
def test_every_exporter_replaces_a_file_atomically(tmp_path: Path, format: str) -> None:
    path = tmp_path / f"take.{format}"
    path.write_text("old")
    export(random_poses(np.random.default_rng(1), seconds=0.5), path, format)
    assert path.stat().st_size > (1_000 if format == "otio" else 10_000)
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize("format", FORMATS)
def test_poses_without_frames_leave_the_old_file(tmp_path: Path, format: str) -> None:
    path = tmp_path / f"take.{format}"
    path.write_text("old")
    with refused(FormatError, "export.no_frame"):
        export(t_pose(0), path, format)
    assert path.read_text() == "old"
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize("format", FORMATS)
def test_a_place_that_cannot_be_written_is_one_clear_error(tmp_path: Path, format: str) -> None:
    (tmp_path / "file").write_text("in the way")
    (tmp_path / "folder").mkdir()
    for path in (tmp_path / "file" / "take", tmp_path / "folder"):
        with refused(StudioError, "file.unwritable_place"):
            export(t_pose(), path, format)
    assert sorted(p.name for p in tmp_path.rglob("*")) == ["file", "folder"]


@pytest.mark.parametrize("format", EXPORTERS)
def test_a_full_disk_is_one_clear_error_and_no_file(
    tmp_path: Path, format: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(_: int) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    if format == "usd":
        pytest.importorskip("pxr")
    monkeypatch.setattr(os, "fsync", full)
    with refused(StudioError, "file.unwritable_place", error="os.enospc"):
        export(t_pose(3), tmp_path / "take", format)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("format", EXPORTERS)
@pytest.mark.parametrize("key", ["positions_m", "rotations_wxyz", "time_s"])
def test_poses_that_are_not_finite_are_refused(tmp_path: Path, format: str, key: str) -> None:
    poses = t_pose(3)
    getattr(poses, key)[1] = np.nan
    with refused(FormatError, "export.times" if key == "time_s" else "export.not_finite"):
        export(poses, tmp_path / "take", format)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("options", "error", "code"),
    [
        ({"format": "doc"}, SettingsError, "export.value"),
        ({"format": "fbx", "interpolation": "bezier"}, SettingsError, "export.value"),
        ({"format": "bvh", "interpolation": "linear"}, SettingsError, "export.not_for_format"),
        ({"format": "fbx", "rotation_order": "XYZ"}, SettingsError, "export.not_for_format"),
        ({"format": "fbx", "unit": "m"}, SettingsError, "export.not_for_format"),
        ({"format": "fbx", "target": "biped"}, SettingsError, "export.value"),
        (
            {"format": "fbx", "key_error_cm": 0.1, "interpolation": "constant"},
            SettingsError,
            "export.key_error_constant",
        ),
        ({"format": "fbx", "key_error_cm": 0.0}, SettingsError, "export.between"),
        ({"format": "fbx", "start_s": 2.0, "end_s": 1.0}, SettingsError, "export.end"),
        ({"format": "fbx", "start_s": 7.0}, SettingsError, "export.start"),
        ({"format": "fbx", "start_s": float("nan")}, SettingsError, "export.seconds"),
        ({"format": "fbx", "smooth_hz": -1.0}, SettingsError, "export.between"),
        ({"format": "fbx", "timecode": "25:00:00:00"}, SettingsError, "export.timecode_range"),
        ({"format": "fbx", "timecode": "noon"}, SettingsError, "export.timecode"),
        ({"format": "fbx", "take_name": ""}, SettingsError, "export.take_name"),
        ({"format": "fbx", "take_name": "a\x00b"}, SettingsError, "export.take_name"),
        ({"format": "bvh", "mesh": True}, SettingsError, "export.not_for_format"),
        ({"format": "bvh", "fps": 0.0}, SettingsError, "export.between"),
        ({"format": "bvh", "fps": 5000.0}, SettingsError, "export.between"),
    ],
)
def test_what_is_refused(tmp_path: Path, options: dict, error: type[StudioError], code: str) -> None:
    with refused(error, code):
        export(t_pose(), tmp_path / "take", **options)
    assert not list(tmp_path.iterdir())
