"""The REST routes: what they answer, and one shape for every failure."""

import json
from typing import Any

import httpx
import msgspec
import pytest

from studio.api.stage.events import StatusEvent
from studio.api.structs import encode
from studio.engine.model.settings.settings import PRESETS, SWITCHES
from studio.take.folder.take import Take
from tests.api.camera import Camera, send_frames, wait_until
from tests.live.performer import calibration
from tests.patient import connect


def codes(answer: dict[str, Any]) -> list[str]:
    """Codes of the sentences of an answer."""
    return [one["code"] for one in answer.get("said", [])]


def assert_error(answer: httpx.Response, status: int, code: str, *said: str) -> None:
    """The answer is a failure in the common shape, with the sentence of this code."""
    assert answer.status_code == status, answer.text
    assert list(answer.json()) == ["error"] and {*answer.json()["error"]} - {"said"} == {"code", "message"}
    assert answer.json()["error"]["code"] == code
    assert not said or codes(answer.json()["error"]) == [*said]


def finished_job(studio, job):
    """The job once it has ended."""
    address = f"/jobs/{job['id']}"
    wait_until(lambda: studio.http.get(address).json()["state"] in ("done", "failed"), "the job ends")
    return studio.http.get(address).json()


def test_status_of_an_empty_stage(studio):
    status = studio.http.get("/status").json()
    assert status["cameras"] == {} and status["recording"]["active"] is False
    assert status["calibration"]["state"] == "none" and status["recording"]["disk_free_gb"] > 0


def test_the_switch_catalogue_has_every_switch_and_preset(studio):
    catalogue = studio.http.get("/switches").json()
    keys = [item["key"] for item in catalogue["switches"]]
    assert set(SWITCHES) - set(keys) == {"effectors", "displacement_limits_m_s", "performers"}
    assert list(catalogue["presets"]) == list(PRESETS)
    by_key = {item["key"]: item for item in catalogue["switches"]}
    assert "points" in by_key["tracker"]["values"] and by_key["flexibility"]["high"] == 2.0
    for name, values in catalogue["presets"].items():
        answer = studio.http.put("/settings", json={"preset": "raw", "set": values})
        assert answer.status_code == 200 and answer.json()["preset"] == name and answer.json()["set"] == {}


def test_settings_come_back_as_they_were_set(studio):
    changes = {"flexibility": 0.5, "effectors.left_elbow.reach": 0.25, "smoothing": "holt:after"}
    studio.http.put("/settings", json={"preset": "thesis", "set": changes}).raise_for_status()
    settings = studio.http.get("/settings").json()
    assert settings["preset"] == "thesis"
    assert settings["set"] == {key: str(value) for key, value in changes.items()}
    assert studio.http.get("/status").json()["settings"]["preset"] is None


@pytest.mark.parametrize(
    ("body", "code", "said"),
    [
        ({"preset": "best"}, "settings", ["settings.unknown_preset"]),
        ({"set": {"fusion": "magic"}}, "settings", ["settings.value"]),
        ({"set": {"colour": "red"}}, "settings", ["settings.unknown"]),
        ({"sets": {}}, "invalid_request", []),
        ({"set": {"flexibility": [1]}}, "invalid_request", []),
    ],
)
def test_settings_that_are_not_allowed(studio, body, code, said):
    assert_error(studio.http.put("/settings", json=body), 422, code, *said)


def test_a_camera_that_the_calibration_lacks_cannot_be_selected(recorded):
    answer = recorded.http.put("/settings", json={"set": {"cameras": "camera_7"}})
    assert_error(answer, 422, "settings", "settings.unknown_cameras")


def test_failures_of_recording(studio):
    assert_error(studio.http.post("/record/stop"), 409, "take", "recording.nothing")
    for name in ("../up", "a/b", ".hidden", "", "x" * 64):
        assert_error(studio.http.post("/record/start", json={"take": name}), 409, "take", "name.not_allowed")
    answer = studio.http.post("/record/start", json={"session": "calibrations"})
    assert_error(answer, 409, "take", "recording.session_reserved")
    studio.http.post("/record/start", json={"session": "s", "take": "t"}).raise_for_status()
    assert_error(studio.http.post("/record/start"), 409, "take", "recording.take_under_way")
    studio.http.post("/record/stop").raise_for_status()
    assert_error(
        studio.http.post("/record/start", json={"session": "s", "take": "t"}), 409, "take", "take.not_empty"
    )
    assert studio.http.post("/record/start", json={"session": "s"}).json()["take"] == "take_001"


def test_a_recording_that_cannot_begin_leaves_the_stage_going(studio):
    (studio.sessions / "s").write_text("a file where the session's folder should be")
    assert_error(studio.http.post("/record/start", json={"session": "s"}), 409, "take", "take.not_made")
    assert studio.http.get("/status").json()["recording"]["active"] is False
    studio.http.post("/record/start", json={"session": "other"}).raise_for_status()


def test_calibration_without_cameras_is_told(studio):
    tall = studio.http.post("/calibration/start", json={"height_m": 175})
    assert_error(tall, 422, "settings", "value.bad")
    answer = studio.http.post("/calibration/start", json={"seconds": 0})
    assert_error(answer, 422, "settings", "settings.seconds")
    assert_error(
        studio.http.post("/calibration/start"), 409, "calibration", "calibration.no_camera_to_calibrate"
    )
    assert studio.http.get("/calibration").json()["calibration"] is None


def test_a_lens_that_cannot_be_is_told(recorded):
    """By the live calibration and by that of a take."""
    bad = {
        "value.bad": [{"field_deg": 200.0}, {"focal_px": 0.0}, {"focal_px": 900.0, "field_deg": 65.0}, {}],
        "calibration.lens_file": [{"file": "lens.toml", "text": "not = "}],
        "calibration.lens_of_none": [{"field_deg": 65.0, "off": 2.0}],  # it measures depth
    }
    with Camera(recorded.url("link"), 0) as camera:
        camera.greet(boot_id="boot-2")
        for code, lenses in bad.items():
            for lens in lenses:
                answer = recorded.http.post("/calibration/start", json={"lenses": {"camera_0": lens}})
                assert_error(answer, 422, "format" if "file" in code else "settings", code)
    answer = recorded.http.post("/calibration/start", json={"lenses": {"camera_0": {"field_deg": "nan"}}})
    assert answer.status_code == 422
    take = recorded.http.post(
        "/takes/tests/one/calibrations", json={"lenses": {"camera_0": bad["value.bad"][0]}}
    )
    assert_error(take, 422, "settings", "value.bad")


def test_a_refused_calibration_keeps_the_last_one(recorded):
    """Standing still is no calibration for two cameras."""
    before = recorded.http.get("/calibration").json()["calibration"]
    with Camera(recorded.url("link"), 0) as first, Camera(recorded.url("link"), 1) as second:
        for camera in (first, second):
            camera.greet(boot_id="boot-2")
            camera.exchange_clocks()
        recorded.http.post("/calibration/start", json={"seconds": 1.0}).raise_for_status()
        assert_error(recorded.http.post("/calibration/start"), 409, "calibration", "calibration.under_way")

        def ended():
            send_frames([first, second], 1)
            return recorded.stage.status().calibration.attempt.state == "failed"

        wait_until(ended, "the calibration was refused")
    now = recorded.http.get("/calibration").json()
    assert now["calibration"] == before and now["number"] == 1 and now["state"] == "good"
    assert "refused" in now["attempt"]["message"]
    assert [file.name for file in (recorded.sessions / "calibrations").iterdir()] == ["1.json"]


def test_takes_are_listed_and_described(recorded):
    (take,) = recorded.http.get("/takes").json()
    assert (take["id"], take["solves"], take["recording"]) == ("tests/one", ["live"], False)
    detail = recorded.http.get("/takes/tests/one").json()
    assert detail["meta"]["cameras"][0]["name"] == "camera_0"
    assert detail["solve_details"]["live"]["metrics"]["frames"] > 0


def test_a_take_is_solved_again_in_the_background(recorded):
    answer = recorded.http.post("/takes/tests/one/solves", json={"preset": "raw", "set": {"output_hz": 30}})
    assert answer.status_code == 202
    job = finished_job(recorded, answer.json())
    assert (job["state"], job["name"], job["progress"]) == ("done", "raw", 1.0), job
    assert recorded.http.get("/takes").json()[0]["solves"] == ["live", "raw"]
    settings = json.loads((recorded.sessions / "tests/one/solves/raw/settings.json").read_text())
    assert settings["output_hz"] == 30 and settings["fusion"] == "mean"
    assert recorded.http.get("/jobs").json() == [job]


def test_a_solve_that_fails_says_why(recorded):
    take = Take.open(recorded.sessions / "tests/one")
    take.add_calibration(calibration(["another"]), use=True)
    answer = recorded.http.post("/takes/tests/one/solves", json={})
    job = finished_job(recorded, answer.json())
    assert job["state"] == "failed" and codes(job) == ["take.nobody_seen"]


def test_a_take_without_calibration_cannot_be_solved(recorded):
    take = Take.open(recorded.sessions / "tests/one")
    take.meta["calibration"] = None
    take.save_meta()
    answer = recorded.http.post("/takes/tests/one/solves", json={})
    assert_error(answer, 409, "calibration", "take.calibration_refused")


def test_an_export_is_downloaded(recorded):
    answer = recorded.http.get("/takes/tests/one/solves/live/export", params={"format": "bvh"})
    assert answer.status_code == 200 and answer.text.startswith("HIERARCHY")
    assert "one_live.bvh" in answer.headers["content-disposition"]
    fbx = recorded.http.get("/takes/tests/one/solves/live/export", params={"format": "fbx", "fps": 30})
    assert fbx.content.startswith(b"Kaydara FBX Binary")
    export = "/takes/tests/one/solves/live/export"
    wanted = {"format": "fbx", "target": "unreal", "root_motion": "root", "mesh": True, "foot_lock": True}
    assert b"ik_hand_gun" in recorded.http.get(export, params=wanted).content
    wrong = recorded.http.get(export, params={"format": "csv", "target": "vrm"})
    assert_error(wrong, 422, "settings", "export.not_for_format")
    assert_error(recorded.http.get(export, params={"format": "exe"}), 422, "invalid_request")
    answer = recorded.http.get("/takes/tests/one/solves/none/export", params={"format": "bvh"})
    assert_error(answer, 404, "not_found", "take.no_solve")


@pytest.mark.parametrize(
    ("path", "status"),
    [
        ("/takes/tests/none", 404),
        ("/takes/tests/..%2f..%2fetc", 404),
        ("/takes/%2e%2e/x", 409),
        ("/takes/..%5c/x", 409),
        ("/takes/.x/y", 409),
        ("/jobs/99", 404),
        ("/nothing", 404),
    ],
)
def test_what_does_not_exist(studio, path, status):
    answer = studio.http.get(path)
    assert_error(answer, status, {404: "not_found", 409: "take"}[status])


def test_a_wrong_method_has_the_same_shape(studio):
    assert_error(studio.http.delete("/status"), 405, "method_not_allowed")


def test_a_body_that_is_not_json_has_the_same_shape(studio):
    answer = studio.http.put("/settings", content=b"{", headers={"content-type": "application/json"})
    assert_error(answer, 422, "invalid_request")


def test_a_page_of_another_site_may_look_but_not_touch(studio):
    elsewhere = {"origin": "http://elsewhere.example"}
    assert_error(studio.http.post("/record/start", headers=elsewhere), 403, "origin")
    own = {"origin": f"http://127.0.0.1:{studio.port}"}
    assert studio.http.post("/record/start", headers=own).status_code == 201


def test_events_push_the_status(studio):
    with connect(studio.url("events")) as events, Camera(studio.url("link"), 0) as camera:
        assert json.loads(events.recv(timeout=60))["status"]["cameras"] == {}
        camera.greet()
        while "camera_0" not in (message := json.loads(events.recv(timeout=60)))["status"]["cameras"]:
            pass
    said = {sentence["text"]: sentence["code"] for sentence in message.pop("said")}
    assert said[message["status"]["cameras"]["camera_0"]["reason"]] == "camera.no_frame_yet"
    assert message["type"] == "status" and message["jobs"] == []
    assert list(message) == [
        "type",
        "status",
        "jobs",
        "local_cameras",
        "thumbnails",
        "takes",
        "devices",
        "triggers",
    ]
    assert json.loads(encode(msgspec.convert(message, StatusEvent))) == message


def test_every_route_is_described(studio):
    description = studio.http.get("/openapi.json").json()
    for path, methods in description["paths"].items():
        for method, route in methods.items():
            assert route.get("description"), f"{method} {path} has no description"
