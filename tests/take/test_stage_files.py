"""Damage of the stage's own files: it is found, and the files are set aside so that the studio starts."""

import json
from pathlib import Path

import pytest

from studio.live.calibration.kept import load_last_calibration, save_calibration
from studio.take.upkeep.doctor import check_takes
from tests.live.performer import calibration


def make_stage(sessions: Path) -> None:
    for _ in range(2):
        save_calibration(sessions / "calibrations", calibration(["camera_0"]), {"camera_0": ""})
    for name in ("access.json", "outputs.json", "presets.json"):
        (sessions / name).write_text('{"format_version": 1}')
    (sessions / "performers").mkdir()
    (sessions / "performers" / "Ann.json").write_text("{}")


def test_whole_files_have_no_findings(tmp_path):
    make_stage(tmp_path)
    assert check_takes(tmp_path) == []


@pytest.mark.parametrize("data", [b"", b"{", b"\xff\x00", b"7"])
@pytest.mark.parametrize(
    "name", ["access.json", "outputs.json", "presets.json", "calibrations/2.json", "performers/Ann.json"]
)
def test_a_damaged_file_is_put_aside(tmp_path, name, data):
    make_stage(tmp_path)
    (tmp_path / name).write_bytes(data)
    (told,) = check_takes(tmp_path, repair=False)
    assert told.path == tmp_path / name and not told.repaired and "studio doctor" in told.action
    (found,) = check_takes(tmp_path)
    assert found.repaired and "put aside" in found.action
    assert (tmp_path / f"{name}.damaged").read_bytes() == data and not (tmp_path / name).exists()
    assert check_takes(tmp_path) == []
    assert load_last_calibration(tmp_path / "calibrations").number == (1 if "calib" in name else 2)


def test_what_a_killed_program_left_is_removed(tmp_path):
    make_stage(tmp_path)
    left = tmp_path / "calibrations" / ".3.json.a1b2"
    left.write_text(json.dumps({"half": 1}))
    (found,) = check_takes(tmp_path)
    assert found.path == left and found.repaired and not left.exists()
