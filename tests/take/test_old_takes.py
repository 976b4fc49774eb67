"""Takes of every earlier version are read, solved again and exported; later versions are refused in words."""

import json
import shutil
from pathlib import Path

import numpy as np
import pytest

from studio.engine.animation.export import export
from studio.engine.base import versions
from studio.engine.base.errors import FormatError, StudioError
from studio.engine.base.versions import KEY, FileFormat
from studio.engine.model.calibration import Calibration
from studio.engine.model.poses import Poses
from studio.engine.model.settings.settings import preset
from studio.engine.whole_take.trace import Trace
from studio.offline.replay import solve_take
from studio.take.folder.solves import TRACE, read_metrics, read_settings
from studio.take.folder.take import Take
from studio.take.library.bundle import read_bundle, write_bundle
from studio.take.raw.frames import camera_frames, inspect_raw
from studio.take.upkeep.doctor import check_takes
from tests.refused import refused

OLD = Path(__file__).parents[1] / "data" / "old_takes"
TAKES = sorted(path.parent for path in OLD.glob("*/*/take.json"))
FORMATS = [value for value in vars(versions).values() if isinstance(value, FileFormat)]


@pytest.fixture(params=TAKES, ids=lambda path: f"{path.parent.name}-{path.name}")
def take(request, tmp_path) -> Take:
    """An old take, on its own."""
    shutil.copytree(request.param, tmp_path / "old" / "take")
    return Take.open(tmp_path / "old" / "take")


def test_there_are_takes_of_every_stage():
    assert len({path.parent for path in TAKES}) >= 6


def test_it_is_read_solved_again_and_exported(take, tmp_path):
    raw = inspect_raw(take.raw_path)
    assert raw.complete and sum(raw.frames.values()) >= 4
    frames = camera_frames(take.raw_path)
    assert set(frames) == {camera["name"] for camera in take.meta["cameras"]}
    for number in take.calibration_numbers():
        file = take.calibration_path(number)
        assert set(Calibration.from_json(json.loads(file.read_text())).cameras) <= set(frames)
    for name in take.solve_names():
        folder = take.solve_folder(name)
        poses = Poses.load(folder / "poses.npz")
        assert np.isfinite(poses.positions_m).all() and read_settings(folder) and read_metrics(folder)
        if (folder / TRACE).is_file():
            Trace.load(folder / TRACE)
    if take.meta["source"] == "import":
        solved = solve_take(take, preset("thesis"), name="again")
        export(Poses.load(solved / "poses.npz"), tmp_path / "again.bvh", "bvh")
        assert (tmp_path / "again.bvh").stat().st_size > 1000


def test_the_doctor_has_nothing_against_it(take):
    assert [problem for problem in check_takes(take.path.parent.parent) if "version" in str(problem)] == []


def test_it_goes_through_one_file(take, tmp_path):
    write_bundle(take, tmp_path / "old.take.zip")
    again = read_bundle(tmp_path / "old.take.zip", tmp_path / "again")
    assert inspect_raw(again.raw_path).frames == inspect_raw(take.raw_path).frames


@pytest.mark.parametrize("kind", FORMATS, ids=lambda kind: kind.name)
@pytest.mark.parametrize("version", [99, -1, "1", True, None])
def test_versions_that_are_not_read(kind, version):
    with refused(FormatError, "file.version"):
        kind.current({KEY: version}, "a file")


@pytest.mark.parametrize("kind", FORMATS, ids=lambda kind: kind.name)
def test_what_is_written_is_read(kind):
    assert kind.current(kind.stamped({"a": 1}), "a file") == {"a": 1}
    assert kind.stamped({KEY: 7, "a": 1}) == {KEY: kind.version, "a": 1}


def test_migrations_come_one_after_the_other():
    kind = FileFormat(
        "tests", 3, {0: lambda value: {**value, "b": 1}, 2: lambda value: {**value, "b": value["b"] + 1}}
    )
    assert kind.current({"a": 0}, "a file") == {"a": 0, "b": 2}
    assert kind.current({KEY: 2, "b": 5}, "a file") == {"b": 6}
    assert kind.current({KEY: 3, "b": 5}, "a file") == {"b": 5}


def test_files_of_a_later_version_are_said(tmp_path):
    source = next(path for path in TAKES if path.name == "imported")
    shutil.copytree(source, tmp_path / "take")
    take = Take.open(tmp_path / "take")
    poses = take.solve_folder("studio") / "poses.npz"
    with np.load(poses) as data:
        arrays = dict(data)
    np.savez(poses, **{**arrays, KEY: 99})
    with refused(FormatError, "file.version", version="99"):
        Poses.load(poses)
    file = take.calibration_path(1)
    file.write_text(json.dumps({**json.loads(file.read_text()), KEY: 99}))
    with refused(StudioError, "file.version", version="99"):
        take.calibration()
    with refused(FormatError, "file.version", version="99"):
        Calibration.from_json({KEY: 99})
    settings = take.solve_folder("studio") / "settings.json"
    settings.write_text(json.dumps({KEY: 99}))
    assert read_settings(settings.parent) is None


def test_every_format_is_documented():
    text = (Path(__file__).parents[2] / "docs" / "formats.md").read_text(encoding="utf-8")
    table = text.partition("## Versions")[2]
    for kind in FORMATS:
        assert f"| {kind.name} | {kind.version} |" in table, kind.name
