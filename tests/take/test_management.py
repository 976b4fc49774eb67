"""Renaming, the trash, and takes as one file."""

import io
import json
import zipfile

import numpy as np
import pytest

from studio import wire
from studio.engine.base.errors import CalibrationError, FormatError, TakeError
from studio.engine.model.calibration import Calibration, CameraCalibration
from studio.engine.model.frames import ClockModel
from studio.take.folder.new import new_take
from studio.take.folder.take import Take
from studio.take.library.borrow import borrow_calibration
from studio.take.library.bundle import read_bundle, write_bundle
from studio.take.library.slate import Slate, change_slate
from studio.take.library.trash import empty_trash, list_trash, restore, throw_away
from studio.take.raw.frames import RawWriter, read_raw
from tests.refused import refused


@pytest.fixture
def sessions(tmp_path):
    folder = tmp_path / "sessions"
    for name in ("one", "two"):
        with new_take(folder / "monday" / name, source="live") as take, RawWriter(take.raw_path):
            (take.path / "solves" / "studio").mkdir(parents=True)
            (take.path / "solves" / "studio" / "poses.npz").write_bytes(b"poses")
            (take.path / "exports" / "a.fbx").write_bytes(b"made again when needed")
    return folder


def test_thrown_away_and_restored(sessions):
    thrown = throw_away(sessions, "monday", "one")
    assert not (sessions / "monday" / "one").exists()
    assert list_trash(sessions) == [thrown]
    assert restore(sessions, thrown.id) == ("monday", "one")
    assert Take.open(sessions / "monday" / "one").solve_names() == ["studio"]
    assert list_trash(sessions) == []


def test_restored_beside_a_new_one(sessions):
    thrown = throw_away(sessions, "monday", "one")
    with new_take(sessions / "monday" / "one", source="live"):
        pass
    assert restore(sessions, thrown.id) == ("monday", "one_2")


def test_emptied(sessions):
    first, _ = throw_away(sessions, "monday", "one"), throw_away(sessions, "monday", "two")
    assert empty_trash(sessions, first.id) == 1
    assert empty_trash(sessions) == 1
    assert list_trash(sessions) == []


@pytest.mark.parametrize("name", ["three", "..", "../../etc", ""])
def test_what_is_not_there_cannot_be_thrown_away(sessions, name):
    with pytest.raises(TakeError):
        throw_away(sessions, "monday", name)


@pytest.mark.parametrize("trash_id", ["", "..", "../monday", "abc", "x/y"])
def test_what_is_not_in_the_trash(sessions, trash_id):
    throw_away(sessions, "monday", "one")
    for action in (restore, empty_trash):
        with refused(TakeError, "trash.none"):
            action(sessions, trash_id)


def test_slate(sessions):
    slate = Slate(name="best", session="tuesday", performer="Ada", notes="good\nfeet", rating=4, starred=True)
    take = change_slate(sessions, "monday", "one", slate)
    assert take.path == sessions / "tuesday" / "best"
    meta = Take.open(take.path).meta
    assert (meta["id"], meta["performer"], meta["notes"]) == ("tuesday/best", "Ada", "good\nfeet")
    assert (meta["rating"], meta["starred"]) == (4, True)
    cleared = change_slate(sessions, "tuesday", "best", Slate(rating=0, starred=False, notes=""))
    assert (cleared.meta["rating"], cleared.meta["starred"], cleared.meta["notes"]) == (None, False, "")
    assert cleared.meta["performer"] == "Ada"


@pytest.mark.parametrize(
    "slate",
    [Slate(name="two"), Slate(name="../x"), Slate(session=".."), Slate(rating=6), Slate(notes="x" * 10_001)],
)
def test_a_slate_that_is_not_allowed_changes_nothing(sessions, slate):
    before = (sessions / "monday" / "one" / "take.json").read_text()
    with pytest.raises(TakeError):
        change_slate(sessions, "monday", "one", slate)
    assert (sessions / "monday" / "one" / "take.json").read_text() == before


def test_one_file_and_back(sessions, tmp_path):
    take = Take.open(sessions / "monday" / "one")
    file = tmp_path / "one.take.zip"
    assert write_bundle(take, file) == file.stat().st_size
    again = read_bundle(file, sessions / "friday" / "copy")
    assert again.meta == {**take.meta, "session": "friday", "name": "copy", "id": "friday/copy"}
    assert again.solve_names() == ["studio"]
    assert list(read_raw(again.raw_path)) == list(read_raw(take.raw_path))
    assert not (again.path / "exports" / "a.fbx").exists()
    with refused(TakeError, "take.not_empty"):
        read_bundle(file, again.path)


def bundle(**files) -> io.BytesIO:
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w") as made:
        for name, data in files.items():
            made.writestr(name, data)
    return out


@pytest.mark.parametrize(
    "name",
    ["../outside.json", "/etc/passwd", "solves/../../x", "exports/a.fbx", "a/b/c/d", "run.sh", "solves/.x/y"],
)
def test_files_that_no_take_has(sessions, tmp_path, name):
    meta = (sessions / "monday" / "one" / "take.json").read_text()
    with refused(FormatError, "bundle.strange_name"):
        read_bundle(bundle(**{"take.json": meta, name: "x"}), tmp_path / "out")
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    "files", [{}, {"take.json": "{"}, {"take.json": "[]"}, {"take.json": json.dumps({"format_version": 99})}]
)
def test_bundles_without_a_take(tmp_path, files):
    with pytest.raises(FormatError):
        read_bundle(bundle(**files), tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_a_cut_or_changed_file(sessions, tmp_path):
    file = tmp_path / "one.take.zip"
    write_bundle(Take.open(sessions / "monday" / "one"), file)
    data = file.read_bytes()
    for damaged in (data[: len(data) // 2], b"", b"no zip", data.replace(b"poses", b"posed")):
        with pytest.raises(FormatError):
            read_bundle(io.BytesIO(damaged), tmp_path / "out")
        assert not (tmp_path / "out").exists()


def calibrated(path, names, serial="", offset_ns=0, metres=1.0):
    """A take with a calibration in use."""
    place = np.eye(4)
    place[0, 3] = metres
    cameras = {name: CameraCalibration(place, clock=ClockModel(offset_ns=offset_ns)) for name in names}
    with new_take(path, source="live") as take:
        for name in names:
            take.add_camera(
                wire.Hello(wire.PROTOCOL_VERSION, name, "test", "canonical", "boot", serial=serial)
            )
        take.add_calibration(Calibration(names[0], cameras), use=True)
    return take


def test_a_borrowed_calibration_keeps_the_takes_own_clocks(tmp_path):
    take = calibrated(tmp_path / "a", ["left", "right"], offset_ns=5)
    other = calibrated(tmp_path / "b", ["left", "right", "third"], offset_ns=7, metres=2.0)
    assert borrow_calibration(take, other) == 2
    found = Take.open(take.path).calibration()
    assert list(found.cameras) == ["left", "right"]
    assert found.cameras["right"].T_stage_camera[0, 3] == 2.0
    assert found.cameras["right"].clock.offset_ns == 5


def test_a_calibration_of_other_cameras_cannot_be_borrowed(tmp_path):
    take = calibrated(tmp_path / "a", ["left", "right"], serial="A")
    with refused(CalibrationError, "calibration.borrow_lacks", names=["right"]):
        borrow_calibration(take, calibrated(tmp_path / "b", ["left"]))
    with refused(CalibrationError, "take.other_device"):
        borrow_calibration(take, calibrated(tmp_path / "c", ["left", "right"], serial="B"))
    assert Take.open(take.path).meta["calibration"] == 1
