"""Exports in the background: one solve, several in a ZIP, several in one FBX, onto a rig; refused exports."""

import io
import zipfile

from studio.take.importers import import_recording
from tests.api.camera import wait_until
from tests.api.test_routes import assert_error, codes
from tests.engine.animation.retarget.rigs import write_rig
from tests.poses_factory import t_pose
from tests.take.test_depth_files import k4a_file
from tests.take.test_raw_depth import depth_take
from tests.web.playback.takes import take_with_solves

FBX = b"Kaydara FBX Binary"


def exported(http, **request):
    """The job of an export once it has ended, and its file."""
    return exported_by(http, "/exports", request)


def exported_by(http, route, request):
    """The same of one of the routes of exports."""
    answer = http.post(route, json=request)
    assert answer.status_code == 202, answer.text
    job = answer.json()
    where = f"/jobs/{job['id']}"
    wait_until(lambda: http.get(where).json()["state"] in ("done", "failed"), "the export is made")
    return http.get(where).json(), http.get(f"/exports/{job['id']}")


def test_one_and_several(studio, tmp_path):
    for number, name in enumerate(("one", "two")):
        take_with_solves(studio.sessions / "monday" / name, seed=number)
    both = [{"take": "monday/one", "solve": "studio"}, {"take": "monday/two", "solve": "live"}]
    job, answer = exported(studio.http, solves=both[:1], format="bvh", fps=30, end_s=1.0)
    assert job["state"] == "done" and job["name"] == "one_studio.bvh", job
    assert answer.text.startswith("HIERARCHY") and "Frames: 31" in answer.text
    job, answer = exported(studio.http, solves=both, format="csv")
    with zipfile.ZipFile(io.BytesIO(answer.content)) as archive:
        assert archive.namelist() == ["monday/one_studio.csv", "monday/two_live.csv"]
        assert archive.read("monday/two_live.csv").startswith(b"time_s")
    job, answer = exported(studio.http, solves=both, format="fbx", together=True)
    assert job["name"] == "takes_2.fbx" and answer.content.startswith(FBX)
    assert b"one" in answer.content and b"two" in answer.content
    studio.http.put(
        "/rigs/hero.glb",
        content=write_rig(tmp_path / "hero.glb", t_pose(2), "vrm", "child", True).read_bytes(),
    ).raise_for_status()
    job, answer = exported(studio.http, solves=both[:1], format="fbx", rig="hero.glb")
    assert job["name"] == "one_studio_hero.fbx" and b"leftUpperLeg" in answer.content


def test_the_depth_of_a_camera(studio, tmp_path):
    http, file = studio.http, k4a_file(tmp_path / "a.mkv", 2)
    import_recording(file, studio.sessions / "monday" / "deep")
    depth_take(studio.sessions / "monday" / "small", 2)
    take_with_solves(studio.sessions / "monday" / "flat")
    listed = {take["name"]: take["depth"] for take in http.get("/takes").json()}
    assert listed == {"deep": ["camera_0"], "small": ["camera_0", "camera_1"], "flat": []}
    job, answer = exported_by(http, "/exports/depth", {"take": "monday/deep"})
    assert job["state"] == "done" and job["name"] == "deep_camera_0_depth.mkv", job
    assert answer.content == file.read_bytes()
    job, _ = exported_by(http, "/exports/depth", {"take": "monday/small", "camera": "camera_1"})
    assert job["state"] == "failed" and codes(job) == ["depth.k4a_size"]
    for wrong, said in (
        ({"take": "monday/flat"}, "depth.none"),
        ({"take": "monday/small"}, "depth.choose_camera"),
        ({"take": "monday/deep", "camera": "x"}, "depth.no_such_camera"),
    ):
        assert_error(http.post("/exports/depth", json=wrong), 409, "take", said)


def test_what_does_not_go(studio):
    take_with_solves(studio.sessions / "monday" / "one")
    one = [{"take": "monday/one", "solve": "studio"}]
    http = studio.http
    assert_error(http.post("/exports", json={"solves": [], "format": "fbx"}), 422, "invalid_request")
    wrong = {"solves": one * 2, "format": "bvh", "together": True}
    assert_error(http.post("/exports", json=wrong), 422, "settings", "export.one_take_together")
    missing = {"solves": [{"take": "monday/one", "solve": "x"}], "format": "fbx"}
    assert_error(http.post("/exports", json=missing), 404, "not_found")
    astray = {"solves": [{"take": "../../etc", "solve": "x"}], "format": "fbx"}
    assert http.post("/exports", json=astray).status_code in (404, 409)
    assert_error(http.get("/exports/99"), 404, "not_found")
    job, answer = exported(http, solves=one, format="fbx", timecode="25:99")
    assert job["state"] == "failed" and codes(job) == ["timecode.text"]
    assert_error(answer, 404, "not_found", "export.not_done")
