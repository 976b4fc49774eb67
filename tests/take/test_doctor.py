"""Damage of each kind is found; what a crash left is repaired, and the repair loses nothing."""

import shutil
from pathlib import Path

import numpy as np
import pytest

from studio.engine.base.errors import TakeError
from studio.engine.model.poses import Poses
from studio.take.folder.new import new_take
from studio.take.folder.take import Take, TakeVersionError
from studio.take.importers import import_recording
from studio.take.raw.frames import RawEvent, RawFrame, RawWriter, inspect_raw, read_raw
from studio.take.upkeep.doctor import check_takes
from studio.take.upkeep.install import PACKAGES, check_install
from studio.take.upkeep.recovery import recover
from tests.refused import refused
from tests.take.helpers import hello, joints_header, joints_rows, recorded_take, write_csv, write_frames
from tests.take.test_take import calibration

NAMES = ["camera_0", "camera_1"]


def snapshot(folder: Path) -> dict[str, bytes]:
    return {str(f.relative_to(folder)): f.read_bytes() for f in sorted(folder.rglob("*")) if f.is_file()}


def crashed_take(path: Path) -> Take:
    """A take whose program died: unfinished raw.mcap, cameras not yet in take.json, state `recording`."""
    take = Take.create(path, session="day", name=path.name, source="live")
    with RawWriter(path / "whole.mcap") as writer:
        for name in NAMES:
            writer.add_camera(hello(name))
        write_frames(writer, NAMES, 0, 20)
        writer.flush()
        size = (path / "whole.mcap").stat().st_size
    data = (path / "whole.mcap").read_bytes()
    take.raw_path.write_bytes(data[: size + 3])
    (path / "whole.mcap").unlink()
    return take


def poses() -> Poses:
    shape = (2, 1)
    rotations = np.zeros((*shape, 4))
    rotations[..., 0] = 1
    return Poses(
        np.array([0.0, 0.1]),
        ("Hips",),
        np.array([-1]),
        np.zeros((*shape, 3)),
        rotations,
        np.ones(shape),
        np.ones(shape),
    )


def test_good_takes_have_no_findings_and_stay_as_they_are(tmp_path: Path) -> None:
    take = recorded_take(tmp_path / "day" / "take_001", NAMES, 5)
    take.add_calibration(calibration(), use=True)
    poses().save(take.solve_folder("studio") / "poses.npz")
    before = snapshot(tmp_path)
    assert (
        check_takes(tmp_path) == [] and check_takes(tmp_path / "day") == [] and check_takes(take.path) == []
    )
    assert snapshot(tmp_path) == before
    with refused(TakeError, "take.no_root"):
        check_takes(tmp_path / "missing")


def test_a_crashed_recording_is_recovered(tmp_path: Path) -> None:
    take = crashed_take(tmp_path / "day" / "take_001")
    damaged = take.raw_path.read_bytes()
    records = list(read_raw(take.raw_path))
    told = check_takes(tmp_path, repair=False)
    assert len(told) == 1 and not told[0].repaired and "studio doctor" in told[0].action
    assert take.raw_path.read_bytes() == damaged
    (finding,) = check_takes(tmp_path)
    assert finding.path == take.path and finding.repaired and "camera_0 20, camera_1 20" in finding.action
    summary = inspect_raw(take.raw_path)
    assert summary.complete and summary.frames == {"camera_0": 20, "camera_1": 20} and summary.events == 20
    for old, new in zip(records, read_raw(take.raw_path), strict=True):
        assert type(old) is type(new)
        if isinstance(old, RawFrame) and isinstance(new, RawFrame):
            assert (old.camera, old.arrival_ns, old.message) == (new.camera, new.arrival_ns, new.message)
        elif isinstance(old, RawEvent):
            assert old == new
    assert (take.path / "raw.damaged.mcap").read_bytes() == damaged
    again = Take.open(take.path)
    assert again.meta["recording"] == "recovered" and again.camera_names == ("camera_0", "camera_1")
    assert check_takes(tmp_path) == []
    assert not list(take.path.glob(".*"))


@pytest.mark.parametrize("data", [b"", b"\x89MCAP", b"no mcap at all"])
def test_a_recording_of_nothing_is_finished_too(tmp_path: Path, data: bytes) -> None:
    take = recorded_take(tmp_path / "take_001", ["camera_0"], 1)
    take.raw_path.write_bytes(data)
    (finding,) = check_takes(tmp_path)
    assert finding.repaired and "none" in finding.action
    assert inspect_raw(take.raw_path).complete and (take.path / "raw.damaged.mcap").read_bytes() == data


def test_a_second_recovery_keeps_the_first_damaged_file(tmp_path: Path) -> None:
    take = crashed_take(tmp_path / "take_001")
    recover(take.path)
    take.raw_path.write_bytes(take.raw_path.read_bytes()[:-20])
    recover(take.path)
    assert (take.path / "raw.damaged.mcap").exists() and (take.path / "raw.damaged.2.mcap").exists()
    assert inspect_raw(take.raw_path).frames == {"camera_0": 20, "camera_1": 20}


def test_a_take_that_is_being_recorded_is_left_alone(tmp_path: Path) -> None:
    take = Take.create(tmp_path / "take_001", session="day", name="take_001", source="live")
    with RawWriter(take.raw_path) as writer:
        writer.add_camera(hello("camera_0"))
        write_frames(writer, ["camera_0"], 0, 3)
        writer.flush()
        assert check_takes(tmp_path) == []
        with refused(TakeError, "take.recording_under_way"):
            recover(take.path)
    (finding,) = check_takes(tmp_path)  # closed, but take.json was never told
    assert finding.repaired and "not ended" in finding.problem
    assert (
        Take.open(take.path).meta["recording"] == "recovered"
        and not (take.path / "raw.damaged.mcap").exists()
    )


@pytest.mark.parametrize("text", [None, "", "{", '{"format_version": 1}'])
def test_take_json_is_rebuilt_from_raw(tmp_path: Path, text: str | None) -> None:
    take = recorded_take(tmp_path / "day" / "take_001", NAMES, 5)
    take.add_calibration(calibration(), use=True)
    take.add_calibration(calibration("refused"), use=False)
    (take.path / "take.json").unlink()
    if text is not None:
        (take.path / "take.json").write_text(text)
    (finding,) = check_takes(tmp_path)
    assert finding.repaired and "take.json" in finding.problem
    again = Take.open(take.path)
    assert (again.meta["session"], again.meta["name"], again.meta["source"]) == ("day", "take_001", "live")
    assert again.camera_names == ("camera_0", "camera_1") and again.meta["calibration"] == 1
    assert again.meta["recording"] == "recovered" and "rebuilt" in again.meta["notes"]
    assert (take.path / "take.damaged.json").exists() == (text is not None)
    assert check_takes(tmp_path) == []


def test_a_rebuilt_import_stays_an_import(tmp_path: Path) -> None:
    write_csv(tmp_path / "in" / "camera_0" / "joints.csv", joints_header(), joints_rows(4))
    take = import_recording(tmp_path / "in", tmp_path / "sessions" / "take")
    (take.path / "take.json").unlink()
    check_takes(tmp_path / "sessions")
    assert Take.open(take.path).meta["source"] == "import"


def test_another_version_is_told_and_never_touched(tmp_path: Path) -> None:
    take = crashed_take(tmp_path / "take_001")
    take.meta["format_version"] = 99
    take.save_meta()
    before = snapshot(tmp_path)
    (finding,) = check_takes(tmp_path)
    assert not finding.repaired and "format version 99" in finding.problem
    with pytest.raises(TakeVersionError):
        recover(take.path)
    assert snapshot(tmp_path) == before


def test_folders_of_killed_imports_are_removed(tmp_path: Path) -> None:
    with new_take(tmp_path / "day" / "take_001", source="import") as take:
        shutil.copytree(take.path, tmp_path / "day" / ".take_002.partial-abcd")  # as a kill would leave it
        (tmp_path / "day" / "take_003.partial-mine").mkdir()
        (finding,) = check_takes(tmp_path)
        assert finding.path.name == ".take_002.partial-abcd" and finding.repaired
        assert take.path.is_dir()
        take.raw_path.write_bytes(b"")
    assert sorted(f.name for f in (tmp_path / "day").iterdir()) == ["take_001", "take_003.partial-mine"]


def test_a_take_with_nothing_in_it_is_told(tmp_path: Path) -> None:
    take = Take.create(tmp_path / "take_001", session="day", name="take_001", source="live")
    (finding,) = check_takes(tmp_path)
    assert not finding.repaired and "no raw.mcap" in finding.problem
    poses().save(take.solve_folder("imported") / "poses.npz")
    assert check_takes(tmp_path) == []
    (take.path / "take.json").write_text("{")
    (finding,) = check_takes(tmp_path)
    assert not finding.repaired
    with refused(TakeError, "take.nothing_left"):
        recover(take.path)


# numpy.load leaves a cut file open when it refuses it
@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
def test_broken_calibrations_and_solves_are_told(tmp_path: Path) -> None:
    take = recorded_take(tmp_path / "take_001", NAMES, 5)
    for _ in range(3):
        take.add_calibration(calibration(), use=True)
    take.calibration_path(1).write_text("{")
    take.calibration_path(2).write_text('{"cameras": {"a": {"T_stage_camera": [[1]]}}}')
    take.calibration_path(3).unlink()
    poses().save(take.solve_folder("good") / "poses.npz")
    data = (take.solve_folder("good") / "poses.npz").read_bytes()
    for name, content in {"cut": data[: len(data) // 2], "empty": b"", "text": b"hello"}.items():
        take.solve_folder(name).mkdir()
        (take.solve_folder(name) / "poses.npz").write_bytes(content)
    take.solve_folder("unfinished").mkdir()
    before = snapshot(tmp_path)
    findings = check_takes(tmp_path)
    assert {str(f.path.relative_to(take.path)) for f in findings} == {
        "calibrations/1.json",
        "calibrations/2.json",
        "calibrations/3.json",
        "solves/cut/poses.npz",
        "solves/empty/poses.npz",
        "solves/text/poses.npz",
        "solves/unfinished",
    }
    assert not any(f.repaired for f in findings)
    assert all("studio" in f.action or "delete" in f.action for f in findings)
    assert snapshot(tmp_path) == before


def test_a_leftover_of_a_killed_recovery_is_removed(tmp_path: Path) -> None:
    take = recorded_take(tmp_path / "take_001", NAMES, 2)
    (take.path / ".raw.recovered-abcd.mcap").write_bytes(b"x")
    assert [f.repaired for f in check_takes(tmp_path)] == [True]
    assert check_takes(tmp_path) == []


def test_the_install_is_in_order(tmp_path: Path) -> None:
    checks = check_install(tmp_path / "sessions")
    assert [c for c in checks if not c.ok] == []
    assert {c.name for c in checks} == {"python", *PACKAGES, "disk", "sessions", "solve"}
    assert list(tmp_path.iterdir()) == []


def test_what_the_install_lacks_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("studio.take.upkeep.install.PACKAGES", ("a_package_that_is_not_there",))
    monkeypatch.setattr("studio.take.upkeep.install.LEAST_FREE_BYTES", 10**18)
    monkeypatch.setattr("studio.take.upkeep.install.tempfile.mkstemp", _refuse)
    failed = {c.name: c for c in check_install(tmp_path / "sessions") if not c.ok}
    assert set(failed) == {"a_package_that_is_not_there", "disk", "sessions"}
    assert all(c.action for c in failed.values())


def _refuse(**_: object) -> None:
    raise PermissionError(13, "Permission denied")
