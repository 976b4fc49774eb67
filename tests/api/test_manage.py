"""Routes that look after takes and measure solves."""

import shutil
from pathlib import Path

import pytest

from studio.engine.base.errors import FormatError
from studio.engine.model.poses import Poses
from studio.take.folder.take import Take
from studio.take.library.sessions import TakeInfo, take_info
from tests.api.test_routes import assert_error, codes, finished_job


def test_a_slate_is_changed(recorded):
    answer = recorded.http.patch(
        "/takes/tests/one", json={"name": "best", "rating": 5, "notes": "n", "starred": True}
    )
    assert answer.status_code == 200
    line = answer.json()
    assert (line["id"], line["rating"], line["notes"], line["starred"]) == ("tests/best", 5, "n", True)
    assert recorded.http.get("/takes").json() == [line]
    assert_error(recorded.http.patch("/takes/tests/one", json={"rating": 1}), 404, "not_found")
    assert_error(recorded.http.patch("/takes/tests/best", json={"rating": 6}), 422, "invalid_request")
    assert_error(recorded.http.patch("/takes/tests/best", json={"name": "../x"}), 409, "take")


def test_the_trash(recorded):
    thrown = recorded.http.delete("/takes/tests/one").json()
    assert recorded.http.get("/takes").json() == []
    assert recorded.http.get("/trash").json() == [thrown]
    line = recorded.http.post(f"/trash/{thrown['id']}/restore").json()
    assert recorded.http.get("/takes").json() == [line]
    assert_error(recorded.http.post(f"/trash/{thrown['id']}/restore"), 409, "take")
    recorded.http.delete("/takes/tests/one").raise_for_status()
    assert recorded.http.delete("/trash").json() == {"deleted": 1}
    assert recorded.http.get("/trash").json() == []


def test_a_take_that_goes_to_the_trash_while_it_is_asked_for_is_not_there(recorded, monkeypatch):
    def meanwhile(take: Take) -> list[str]:
        shutil.rmtree(take.path)
        raise FileNotFoundError(take.path)  # as a search for files does whose folder vanishes

    monkeypatch.setattr(Take, "solve_names", meanwhile)
    assert_error(recorded.http.get("/takes/tests/one"), 404, "not_found", "take.none")


def test_a_take_that_goes_to_the_trash_while_its_line_is_made_is_not_there(recorded, monkeypatch):
    def meanwhile(path: Path) -> TakeInfo:
        shutil.rmtree(path)
        return take_info(path)

    monkeypatch.setattr("studio.api.takes.takes.take_info", meanwhile)
    assert_error(recorded.http.get("/takes/tests/one"), 404, "not_found", "take.none")


def test_a_take_that_goes_to_the_trash_while_it_is_measured_is_not_there(recorded, monkeypatch):
    def meanwhile(*_: object) -> None:
        shutil.rmtree(recorded.sessions / "tests/one")
        raise FormatError("poses.npz: not readable")  # as a file that is read says whose folder vanishes

    monkeypatch.setattr("studio.api.takes.measure.run_in_process", meanwhile)
    assert_error(recorded.http.get("/takes/tests/one/solves/live/figures"), 404, "not_found", "take.none")


def test_a_solve_that_cannot_be_read_is_said_to_be_so(recorded):
    (recorded.sessions / "tests/one/solves/live/poses.npz").write_bytes(b"PK")
    assert_error(recorded.http.get("/takes/tests/one/solves/live/figures"), 422, "format")


def test_a_solve_goes_to_the_trash_and_back(recorded):
    thrown = recorded.http.delete("/takes/tests/one/solves/live").json()
    assert (thrown["name"], thrown["solve"]) == ("one", "live")
    assert recorded.http.get("/takes").json()[0]["solves"] == []
    assert recorded.http.get("/trash").json() == [thrown]
    assert_error(recorded.http.delete("/takes/tests/one/solves/live"), 404, "not_found")
    assert recorded.http.post(f"/trash/{thrown['id']}/restore").json()["solves"] == ["live"]
    thrown = recorded.http.delete("/takes/tests/one/solves/live").json()
    recorded.http.delete("/takes/tests/one").raise_for_status()
    assert_error(recorded.http.post(f"/trash/{thrown['id']}/restore"), 409, "take", "trash.take_gone")


def test_what_is_being_recorded_stays(recorded):
    recorded.http.post("/record/start", json={"session": "tests", "take": "two"}).raise_for_status()
    for answer in (
        recorded.http.delete("/takes/tests/two"),
        recorded.http.patch("/takes/tests/two", json={"name": "three"}),
        recorded.http.get("/takes/tests/two/file"),
    ):
        assert_error(answer, 409, "take", "take.recording")
    recorded.http.post("/record/stop").raise_for_status()


def test_a_take_as_one_file(recorded):
    file = recorded.http.get("/takes/tests/one/file")
    assert "one.take.zip" in file.headers["content-disposition"]
    answer = recorded.http.post("/takes/other/copy/file", content=file.content)
    assert answer.status_code == 201, answer.text
    assert answer.json()["solves"] == ["live"]
    copy, first = (Take.open(recorded.sessions / path) for path in ("other/copy", "tests/one"))
    assert copy.raw_path.read_bytes() == first.raw_path.read_bytes()
    assert_error(
        recorded.http.post("/takes/other/copy/file", content=file.content), 409, "take", "take.not_empty"
    )
    assert_error(recorded.http.post("/takes/other/b/file", content=file.content[:900]), 422, "format")
    assert not [path for path in recorded.sessions.iterdir() if path.name.startswith(".upload")]


def test_solves_are_compared_and_measured(recorded):
    finished_job(recorded, recorded.http.post("/takes/tests/one/solves", json={"preset": "raw"}).json())
    same = recorded.http.get("/takes/tests/one/compare", params={"a": "live", "b": "live"}).json()
    assert same["max_mm"] < 1e-6
    other = recorded.http.get("/takes/tests/one/compare", params={"a": "live", "b": "raw"}).json()
    assert other["mean_mm"] > 0
    assert other["worst"][0]["mm"] == pytest.approx(other["max_mm"])
    assert_error(
        recorded.http.get("/takes/tests/one/compare", params={"a": "x", "b": "raw"}), 404, "not_found"
    )
    evaluate = {"reference": "truth.csv", "solves": ["live"]}
    assert_error(
        recorded.http.post("/takes/tests/one/evaluate", json=evaluate),
        404,
        "not_found",
        "reference.send_first",
    )
    start_s = Poses.load(recorded.sessions / "tests/one/solves/live/poses.npz").time_s[0]
    rows = "".join(f"{start_s - 1 + i / 30},0,0,1,{i / 900},0,1.5,0.2,0,{1 + i / 900}\n" for i in range(120))
    header = "time_s,hips_x,hips_y,hips_z,head_x,head_y,head_z,left_wrist_x,left_wrist_y,left_wrist_z\n"
    sent = recorded.http.put("/takes/tests/one/references/truth.csv", content=header + rows)
    assert sent.status_code == 201
    assert recorded.http.get("/takes/tests/one/references").json() == ["truth.csv"]
    answer = recorded.http.post("/takes/tests/one/evaluate", json=evaluate)
    assert answer.status_code == 200, answer.text
    found = answer.json()
    assert set(found["solves"]) == {"live"}
    assert found["solves"]["live"]["matched_joints"] == ["hips", "head", "left_wrist"]


@pytest.mark.parametrize("name", ["x.exe", "..%2f..%2fx.csv", ".hidden.csv", "take.json"])
def test_references_of_other_names(recorded, name):
    assert recorded.http.put(f"/takes/tests/one/references/{name}", content=b"x").status_code in (
        404,
        405,
        409,
        422,
    )
    assert not (Take.open(recorded.sessions / "tests/one").path / "references").exists()


def test_a_take_is_calibrated_again_or_borrows(recorded):
    before = recorded.http.get("/takes/tests/one/calibrations").json()
    file = recorded.http.get("/takes/tests/one/file").content
    recorded.http.post("/takes/other/copy/file", content=file).raise_for_status()
    borrowed = recorded.http.post("/takes/other/copy/calibrations", json={"borrow": "tests/one"}).json()
    assert borrowed == {"state": "done", "number": before["numbers"][-1] + 1}
    assert recorded.http.get("/takes/other/copy/calibrations").json()["in_use"] == borrowed["number"]
    again = recorded.http.put("/takes/other/copy/calibrations/in_use", json={"number": before["in_use"]})
    assert again.json() == {**before, "numbers": [*before["numbers"], borrowed["number"]]}
    answer = recorded.http.put("/takes/other/copy/calibrations/in_use", json={"number": 99})
    assert_error(answer, 409, "calibration", "take.no_such_calibration")
    answer = recorded.http.post("/takes/other/copy/calibrations", json={"borrow": "tests/none"})
    assert_error(answer, 404, "not_found")
    answer = recorded.http.post("/takes/tests/one/calibrations", json={"reference": "camera_9"})
    assert answer.status_code == 202
    job = finished_job(recorded, answer.json())
    assert job["state"] == "failed"
    assert codes(job) == ["calibration.no_such_reference"]


def test_takes_are_searched_and_paged(recorded):
    changed = recorded.http.patch(
        "/takes/tests/one",
        json={"tags": [" best ", "Best", "stage  fight"], "performer": "Élodie", "rating": 4},
    )
    assert changed.json()["tags"] == ["best", "stage fight"]
    line = recorded.http.get("/takes").json()[0]
    for search in ("elodie", 'tag:"stage fight"', "-tag:other rating:>3", "session:tests is:solved"):
        answer = recorded.http.get("/takes", params={"search": search, "limit": 5})
        assert (answer.json(), answer.headers["x-total-count"]) == ([line], "1"), search
    nothing = recorded.http.get("/takes", params={"search": "tag:fight"})
    assert (nothing.json(), nothing.headers["x-total-count"]) == ([], "0")
    counted = recorded.http.get("/takes", params={"limit": 0})
    assert (counted.json(), counted.headers["x-total-count"]) == ([], "1")
    assert recorded.http.get("/takes", params={"id": ["tests/one", "tests/none"]}).json() == [line]
    for search, said in (("colour:red", "search.field"), ("length:long", "search.term")):
        assert_error(recorded.http.get("/takes", params={"search": search}), 422, "settings", said)
    assert_error(recorded.http.patch("/takes/tests/one", json={"tags": ["a,b"]}), 409, "take", "slate.tag")
    following = recorded.http.get("/takes/next").json()
    assert following["name"] == "take_001"


def test_markers_are_kept_with_the_take(recorded):
    markers = [{"time_s": 1.5, "name": "kick"}, {"time_s": 0.25, "name": " begin "}]
    recorded.http.patch("/takes/tests/one", json={"markers": markers}).raise_for_status()
    kept = recorded.http.get("/takes/tests/one").json()["meta"]["markers"]
    assert kept == [{"time_s": 0.25, "name": "begin"}, {"time_s": 1.5, "name": "kick"}]
    recorded.http.patch("/takes/tests/one", json={"notes": "other"}).raise_for_status()
    assert recorded.http.get("/takes/tests/one").json()["meta"]["markers"] == kept
    nameless = recorded.http.patch("/takes/tests/one", json={"markers": [{"time_s": 0, "name": " "}]})
    assert_error(nameless, 409, "take", "slate.marker")
    recorded.http.patch("/takes/tests/one", json={"markers": []}).raise_for_status()
    assert recorded.http.get("/takes/tests/one").json()["meta"]["markers"] == []
