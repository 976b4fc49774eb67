"""The list of takes, and the names of new ones."""

from pathlib import Path

import pytest

from studio.engine.base.errors import TakeError
from studio.take.folder.take import Take
from studio.take.library.sessions import TakeInfo, new_take_path, take_ids, take_info, take_path
from tests.refused import refused
from tests.take.helpers import FRAME_NS, recorded_take


def listed(sessions: Path) -> list[TakeInfo]:
    """Every take in the folder by session and name."""
    return [
        take_info(sessions / id_) for id_ in take_ids(sessions) if (sessions / id_ / "take.json").is_file()
    ]


def test_takes_are_listed_from_the_folders(tmp_path: Path) -> None:
    recorded_take(tmp_path / "day" / "take_002", ["camera_0", "camera_1"], 31)
    take = recorded_take(tmp_path / "day" / "take_001", ["camera_0"], 1)
    (take.solve_folder("studio")).mkdir()
    (take.solve_folder("studio") / "poses.npz").write_bytes(b"")
    (tmp_path / "day" / "broken").mkdir()
    (tmp_path / "day" / "broken" / "take.json").write_text("{")
    (tmp_path / "day" / "no_take").mkdir()
    (tmp_path / ".hidden" / "t").mkdir(parents=True)
    (tmp_path / ".hidden" / "t" / "take.json").write_text("{}")
    broken, first, second = listed(tmp_path)
    assert (broken.name, broken.state, broken.length_s) == ("broken", "damaged", None)
    assert "take.json" in (broken.problem or "")
    assert (first.session, first.name, first.solves, first.length_s) == ("day", "take_001", ("studio",), 0.0)
    assert second.cameras == ("camera_0", "camera_1") and second.state == "done" and second.problem is None
    assert second.length_s == pytest.approx(30 * FRAME_NS * 1e-9)


def test_an_unfinished_recording_has_no_length(tmp_path: Path) -> None:
    take = recorded_take(tmp_path / "day" / "take_001", ["camera_0"], 30)
    data = take.raw_path.read_bytes()
    for place in (0, 10, len(data) // 2, len(data) - 1):
        take.raw_path.write_bytes(data[:place])
        (info,) = listed(tmp_path)
        assert info.length_s is None
    take.raw_path.unlink()
    assert listed(tmp_path)[0].length_s is None
    assert listed(tmp_path / "missing") == []


def test_new_takes_are_numbered(tmp_path: Path) -> None:
    assert new_take_path(tmp_path, "day") == tmp_path / "day" / "take_001"
    for name in ("take_001", "take_009", "take_x", "other_044"):
        (tmp_path / "day" / name).mkdir(parents=True)
    assert new_take_path(tmp_path, "day").name == "take_010"
    assert new_take_path(tmp_path, "day", prefix="other").name == "other_045"
    (tmp_path / "day" / "take_999").mkdir()
    assert new_take_path(tmp_path, "day").name == "take_1000"


@pytest.mark.parametrize("name", ["..", "../x", "/tmp", "", "a/b", ".x"])
def test_hostile_names_do_not_leave_the_folder(tmp_path: Path, name: str) -> None:
    with refused(TakeError, "name.not_allowed"):
        take_path(tmp_path, "day", name)
    with refused(TakeError, "name.not_allowed"):
        take_path(tmp_path, name, "take_001")
    with refused(TakeError, "name.not_allowed"):
        new_take_path(tmp_path, name)
    with refused(TakeError, "name.not_allowed"):
        new_take_path(tmp_path, "day", prefix=f"{name}/")


def test_a_link_out_of_the_folder_is_refused(tmp_path: Path) -> None:
    (tmp_path / "sessions").mkdir()
    (tmp_path / "sessions" / "day").symlink_to(tmp_path)
    with refused(TakeError, "name.leads_out"):
        take_path(tmp_path / "sessions", "day", "take_001")


def test_the_list_tells_the_part_before_the_performance(tmp_path: Path) -> None:
    for name, before_s in (("imported", 34.0), ("live", None)):
        Take.create(
            tmp_path / "a" / name, session="a", name=name, source="import", calibration_s=before_s
        ).save_meta()
    found = {name: take_info(tmp_path / "a" / name).calibration_s for name in ("imported", "live")}
    assert found == {"imported": 34.0, "live": None}


def test_the_list_follows_what_changes(tmp_path: Path) -> None:
    take = recorded_take(tmp_path / "day" / "take_001", ["camera_0"], 5)
    (before,) = listed(tmp_path)
    assert listed(tmp_path) == [before]
    take.meta["notes"] = "changed"
    take.save_meta()
    (take.path / "solves" / "new").mkdir(parents=True)
    assert listed(tmp_path)[0].notes == "changed" and listed(tmp_path)[0].solves == ()
    (take.path / "solves" / "new" / "poses.npz").write_bytes(b"")
    assert listed(tmp_path)[0].solves == ("new",)
    (take.path / "take.json").write_text("{")
    assert listed(tmp_path)[0].problem
