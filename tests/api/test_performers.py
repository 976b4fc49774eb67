"""Routes of takes of several performers: names, exchanges, exports, figures, reports."""

import io
import zipfile

import pytest

from tests.api.camera import wait_until
from tests.api.test_exports import FBX, exported
from tests.api.test_routes import assert_error
from tests.web.playback.takes import FRAMES, LATE_S, take_of_two

TAKE = "/takes/monday/fight"
SOLVE = {"take": "monday/fight", "solve": "studio"}


@pytest.fixture
def http(studio):
    take_of_two(studio.sessions / "monday" / "fight")
    return studio.http


def test_names_and_exchanges_are_kept_and_taken_back(http):
    exchange = {"time_s": 1.5, "performers": ["performer_1", "performer_2"]}
    line = http.patch(TAKE, json={"performer_names": {"performer_2": "Ana"}, "exchanges": [exchange]}).json()
    assert line["performers"] == ["performer_1", "performer_2"]
    assert line["performer_names"] == {"performer_2": "Ana"}
    assert http.get(TAKE).json()["meta"]["exchanges"] == [exchange]
    found = [one["id"] for one in http.get("/takes", params={"search": "performer:ana performers:>1"}).json()]
    assert found == ["monday/fight"]
    assert http.patch(TAKE, json={"exchanges": []}).json()["performer_names"] == {"performer_2": "Ana"}
    assert http.get(TAKE).json()["meta"]["exchanges"] == []
    same = {"performer_1": "Ana", "performer_2": "ana"}
    assert_error(http.patch(TAKE, json={"performer_names": same}), 409, "take", "performers.same_name")


def test_each_makes_a_file_or_all_make_one(http):
    http.patch(TAKE, json={"performer_names": {"performer_2": "Ana"}}).raise_for_status()
    job, answer = exported(http, solves=[SOLVE], format="bvh")
    assert job["name"] == "fight_studio.zip"
    with zipfile.ZipFile(io.BytesIO(answer.content)) as archive:
        names = archive.namelist()
        assert names == ["monday/fight_studio-performer_1.bvh", "monday/fight_studio-Ana.bvh"]
        assert all(f"Frames: {FRAMES}".encode() in archive.read(name) for name in names)
    job, answer = exported(http, solves=[SOLVE], format="csv", performer="Ana", end_s=1.0)
    assert job["name"] == "fight_studio-Ana.csv"
    assert len(answer.text.splitlines()) == 1 + 61 - round(LATE_S * 60)  # a part counts for all alike
    job, answer = exported(http, solves=[SOLVE], format="fbx", together=True)
    assert job["name"] == "fight_studio.fbx" and answer.content.startswith(FBX)
    assert b"Ana:Hips" in answer.content and b"performer_1:Hips" in answer.content
    one = http.get(f"{TAKE}/solves/studio/export", params={"format": "glb", "together": True})
    assert one.content.startswith(b"glTF")
    wrong = {"solves": [SOLVE], "format": "bvh", "together": True}
    assert_error(http.post("/exports", json=wrong), 422, "settings", "export.one_performer_format")
    nobody = {"solves": [SOLVE], "format": "bvh", "performer": "Bob"}
    assert_error(http.post("/exports", json=nobody), 409, "take", "take.no_performer")


def test_figures_are_those_of_a_performer(http, studio):
    own = {one: http.get(f"{TAKE}/solves/studio/figures", params={"performer": one}).json()["own"]
           for one in ("performer_1", "performer_2")}  # fmt: skip
    assert own["performer_1"]["frames"] == FRAMES
    assert own["performer_2"]["frames"] == FRAMES - round(LATE_S * 60)
    second = studio.sessions / "monday/fight/solves/studio/performer_2/poses.npz"
    reference = f"{TAKE}/references/ana.npz"
    http.put(reference, content=second.read_bytes()).raise_for_status()
    how = {"solve": "studio", "align_time": False, "performer": "performer_2"}
    http.post(f"{reference}/align", json=how).raise_for_status()
    assert http.get(reference).json()["performer"] == "performer_2"
    a, b = {**SOLVE, "performer": "performer_2"}, {"reference": "ana.npz"}
    assert http.post("/compare", json={"a": a, "b": b}).json()["max_mm"] < 1.0
    made = http.post(f"{TAKE}/reports", json={"reference": "ana.npz"}).json()
    wait_until(lambda: http.get(f"/jobs/{made['id']}").json()["state"] != "running", "the report is made")
    wait_until(lambda: http.get(f"/jobs/{made['id']}").json()["state"] in ("done", "failed"), "it has ended")
    page = http.get(f"{TAKE}/reports/{made['name']}").text
    assert "became another" in page and "performer_2" in page


def test_all_who_have_a_reference_are_measured_at_once(http, studio):
    refused = http.post(f"{TAKE}/evaluate-together", json={})
    assert_error(refused, 404, "not_found", "reference.of_nobody")
    folder = studio.sessions / "monday/fight/solves/studio"
    assert searched(http, "error:<20") == []
    for performer in ("performer_1", "performer_2"):
        reference = f"{TAKE}/references/{performer}.npz"
        http.put(reference, content=(folder / performer / "poses.npz").read_bytes()).raise_for_status()
        how = {"solve": "studio", "align_time": False, "performer": performer}
        http.post(f"{reference}/align", json=how).raise_for_status()
    answer = http.post(f"{TAKE}/evaluate-together", json={"solves": ["studio"]})
    assert answer.status_code == 200, answer.text
    assert answer.json()["references"] == {f"performer_{k}": f"performer_{k}.npz" for k in (1, 2)}
    found = answer.json()["solves"]["studio"]
    assert found["identity_switches"] == 0 and found["missed_percent"] == 0.0
    assert [one["mpjpe_mm"] < 1.0 for one in found["performers"].values()] == [True, True]
    page = http.get(f"{TAKE}/report", params={"reference": "performer_2.npz"}).text
    assert "became another" in page and "joint error of performer_1" in page
    assert searched(http, "error:<20") == ["monday/fight"] and searched(http, "error:>20") == []
    assert searched(http, "jitter:<1000") == []
    http.get(f"{TAKE}/solves/studio/figures", params={"performer": "performer_2"}).raise_for_status()
    assert searched(http, "jitter:<1000") == ["monday/fight"]


def searched(http, words: str) -> list[str]:
    """The takes that a search finds."""
    found = http.get("/takes", params={"search": words}).json()
    return [f"{one['session']}/{one['name']}" for one in found]


def test_a_shared_replay_has_everybody(http):
    made = http.post(f"{TAKE}/solves/studio/share", json={}).json()
    assert "performer_1, performer_2" in http.get(f"/shares/{made['id']}/file").text
