"""Atomic writing: the old file or the new one, never half of one, nothing left behind."""

import json
import os

import pytest

from studio.engine.base.errors import StudioError
from studio.engine.base.files import write_atomically, write_json
from tests.refused import refused


def test_it_makes_the_folder_and_the_file(tmp_path):
    path = tmp_path / "a" / "b.bin"
    with write_atomically(path) as file:
        file.write(b"abc")
        assert not path.exists(), "not before the end"
    assert path.read_bytes() == b"abc"
    assert os.listdir(path.parent) == ["b.bin"]
    assert path.stat().st_mode & 0o777 == 0o644


def test_an_error_on_the_way_leaves_the_old_file(tmp_path):
    path = tmp_path / "a.bin"
    path.write_bytes(b"old")
    with pytest.raises(RuntimeError, match="halfway"), write_atomically(path) as file:
        file.write(b"new")
        raise RuntimeError("halfway")
    assert path.read_bytes() == b"old" and os.listdir(tmp_path) == ["a.bin"]


def test_a_folder_that_is_a_file_is_told(tmp_path):
    (tmp_path / "file").write_bytes(b"")
    with refused(StudioError, "file.unwritable_place"), write_atomically(tmp_path / "file" / "b"):
        pytest.fail("there is nowhere to write to")


def test_a_full_disk_is_told_and_leaves_the_old_file(tmp_path):
    path = tmp_path / "a.bin"
    path.write_bytes(b"old")
    with (
        refused(StudioError, "file.unwritable_place", error="os.enospc"),
        write_atomically(path),
    ):
        raise OSError(28, "No space left on device")
    assert path.read_bytes() == b"old" and os.listdir(tmp_path) == ["a.bin"]


def test_json_round_trips_and_refuses_what_json_cannot_say(tmp_path):
    path = tmp_path / "a.json"
    write_json(path, {"a": [1, None, 0.5], "é": "ü"})
    assert json.loads(path.read_text()) == {"a": [1, None, 0.5], "é": "ü"}
    with pytest.raises(ValueError, match="not JSON compliant"):
        write_json(path, {"a": float("nan")})
    assert json.loads(path.read_text())["a"] == [1, None, 0.5]
