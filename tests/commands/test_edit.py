"""`studio edit` shows and changes the edits of a take."""

import json

import pytest

from studio.take.edits.kept import read_edits
from tests.commands.program import one_line, studio
from tests.web.playback.takes import take_with_solves


@pytest.fixture
def take(tmp_path):
    return take_with_solves(tmp_path / "monday" / "walk")


def edit(take, *words: str) -> str:
    """Return what `studio edit` prints."""
    done = studio("edit", take.path, *words, cwd=take.path)
    assert (done.returncode, done.stderr) == (0, "")
    return done.stdout


PIN = ("add", "pin", "joint=left_wrist", "at=0.5", "place_m=0.3,-0.2,1.1", "radius_m=0.02", "note=by eye")


def test_an_edit_is_made_changed_switched_and_taken_back(take):
    assert edit(take) == "no edits\n"
    told = edit(take, *PIN)
    assert "joint=left_wrist place_m=0.3,-0.2,1.1 radius_m=0.02  by eye" in told and "new: e1" in told
    assert "run `studio solve" in told
    edit(take, "set", "e1", "end_s=0.7", "place_m=0,0,1")
    edit(take, "off", "e1")
    (only,) = read_edits(take).edits
    assert (only.start_s, only.end_s, only.place_m, only.on) == (0.5, 0.7, (0.0, 0.0, 1.0), False)
    edit(take, "undo")
    assert read_edits(take).edits[0].on
    edit(take, "redo")
    edit(take, "on", "e1")
    edit(take, "add", "leave_out", "joints=left_wrist,left_hand", "start_s=0.2", "end_s=0.4")
    edit(take, "remove", "e1")
    assert [one.joints for one in read_edits(take).edits] == [("left_wrist", "left_hand")]


def test_edits_are_written_and_read_as_json(take, tmp_path):
    edit(take, *PIN)
    file = tmp_path / "edits.json"
    edit(take, "list", "--json", str(file))
    written = json.loads(file.read_text())
    assert (written["revision"], written["can_undo"], written["edits"][0]["kind"]) == (1, True, "pin")
    edit(take, "remove", "e1")
    edit(take, "add", "trim", "start_s=0.1", "end_s=1.9")
    assert edit(take, "replace", str(file)).splitlines()[1].startswith("e1")
    assert len(read_edits(take).edits) == 1
    edit(take, "undo")  # the file was one change
    assert [one.id for one in read_edits(take).edits] == ["e3"]


@pytest.mark.parametrize(
    ("words", "code"),
    [
        (("add",), 2),
        (("add", "pin", "left_wrist"), 2),
        (("add", "pin", "joint=tail", "at=0.5", "place_m=0,0,1"), 1),
        (("add", "pin", "joint=head", "at=noon", "place_m=0,0,1"), 1),
        (("add", "wish", "at=0.5"), 1),
        (("set", "e9", "on=false"), 1),
        (("remove", "e9"), 1),
        (("undo",), 1),
        (("undo", "e1"), 2),
        (("replace", "nothing.json"), 1),
    ],
)
def test_what_is_wrong_is_told_in_one_line(take, words, code):
    one_line(studio("edit", take.path, *words, cwd=take.path), code)
    assert not (take.path / "edits.json").exists()


@pytest.mark.parametrize("other", ["--as-live", "--no-edits"])
def test_a_take_does_not_mend_itself_without_edits(take, other):
    done = studio("solve", take.path, "--auto", other, cwd=take.path)
    assert "--auto makes edits" in one_line(done, 2)
