"""References over the API: checked when sent, taken from beside the takes, aligned, removed and put back."""

import numpy as np

from studio.take.folder.take import Take
from tests.api.camera import wait_until
from tests.api.test_measure import reference_of
from tests.api.test_routes import assert_error

TAKE = "/takes/tests/one"


def test_one_that_cannot_be_read_is_refused_and_not_kept(recorded):
    http = recorded.http
    for name, content, said in [
        ("cut.csv", "time_s,hips_x\n0,1\n", "reference.missing_column"),
        ("noise.bvh", b"\x00\xff" * 500, "bvh.not_bvh"),
        ("empty.c3d", b"", "c3d.not_c3d"),
        ("motion.exe", b"MZ", "reference.unread_kind"),
        (f"{'long' * 14}.csv", reference_of(recorded), "reference.name_length"),
    ]:
        answer = http.put(f"{TAKE}/references/{name}", content=content)
        assert_error(answer, 422, "format", said)
        assert str(recorded.sessions) not in answer.text
    assert http.put(f"{TAKE}/references/..%2f..%2fx.csv", content="a").status_code in (404, 405, 409)
    assert http.get(f"{TAKE}/references").json() == []
    assert not list((recorded.sessions / "tests/one").glob(".reference-*"))


def test_a_file_beside_the_takes(recorded):
    http = recorded.http
    (recorded.sessions / "tests/one.truth.csv").write_text(reference_of(recorded))
    (recorded.sessions.parent / "outside.csv").write_text(reference_of(recorded))
    (recorded.sessions / "tests/link.csv").symlink_to(recorded.sessions.parent / "outside.csv")
    assert http.get("/reference-files").json() == ["tests/one.truth.csv"]
    answer = http.post(f"{TAKE}/references", json={"file": "tests/one.truth.csv"})
    assert answer.status_code == 201, answer.text
    assert answer.json()["joints"] == ["hips", "head", "left_wrist"]
    for file in ("../outside.csv", "tests/link.csv", "/etc/passwd", "tests/one/take.json"):
        assert_error(
            http.post(f"{TAKE}/references", json={"file": file}), 409, "take", "reference.not_offered"
        )


def test_aligned_compared_measured_removed_restored(recorded):
    http = recorded.http
    http.put(f"{TAKE}/references/truth.csv", content=reference_of(recorded)).raise_for_status()
    where = f"{TAKE}/references/truth.csv"
    wanted = {"solve": "live", "align_time": False, "align": "similarity"}
    found = http.post(f"{where}/align", json=wanted).json()
    assert found["aligned"]["kind"] == "similarity" and found["aligned"]["scale"] != 1.0
    assert found["from_s"] < 0.0 < found["to_s"]
    kept = http.get(where).json()
    assert (kept["align_time"], kept["align"], kept["aligned_with"]) == (False, "similarity", {"live": found})
    both = {"a": {"take": "tests/one", "solve": "live"}, "b": {"reference": "truth.csv"}}
    compared = http.post("/compare", json=both).json()
    assert set(compared["per_joint_mm"]) == {"hips", "head", "left_wrist"}
    assert compared["aligned"] == found["aligned"] and len(compared["frame"]) <= 1200
    figures = http.get(f"{TAKE}/solves/live/figures", params={"reference": "truth.csv"}).json()
    assert figures["reference"]["alignment"]["kind"] == "similarity"
    assert figures["own"]["bone_length_sd_mm"] == 0.0
    assert http.delete(where).json() == {"removed": "truth.csv"}
    assert http.get(f"{TAKE}/references").json() == []
    assert not list(Take.open(recorded.sessions / "tests/one").solve_folder("live").glob("references/*"))
    assert_error(http.post(f"{where}/align", json=wanted), 404, "not_found", "reference.send_first")
    http.post(f"{where}/restore").raise_for_status()
    assert http.get(where).json()["align"] == "similarity"
    assert_error(http.post(f"{where}/restore"), 409, "take")


def test_a_solve_is_as_far_from_itself_as_it_is_moved(recorded):
    http = recorded.http
    own = {"take": "tests/one", "solve": "live"}
    found = http.post("/compare", json={"a": own, "b": {"solve": "live"}}).json()
    assert found["max_mm"] < 1e-6 and found["alignment"]["time_offset_ms"] == 0.0
    assert len(found["worst"]) >= 1
    moved = http.post("/compare", json={"a": own, "b": {"solve": "live"}, "offset_ms": 50.0}).json()
    assert moved["frames"] < found["frames"] and np.isfinite(moved["mean_mm"])
    for wrong in ({}, {"solve": "live", "reference": "x.csv"}):
        assert_error(
            http.post("/compare", json={"a": own, "b": wrong}), 422, "settings", "compare.one_of_two"
        )
    assert_error(http.post("/compare", json={"a": own, "b": {"reference": "x.csv"}}), 404, "not_found")


def test_the_report_is_made_in_the_background(recorded):
    http = recorded.http
    http.put(f"{TAKE}/references/truth.csv", content=reference_of(recorded)).raise_for_status()
    job = http.post(f"{TAKE}/reports", json={"reference": "truth.csv"}).json()
    assert job["kind"] == "report"
    wait_until(lambda: http.get(f"/jobs/{job['id']}").json()["state"] in ("done", "failed"), "made")
    assert http.get(f"/jobs/{job['id']}").json()["state"] == "done"
    page = http.get(f"{TAKE}/reports/{job['name']}")
    assert "<svg" in page.text and "default-src 'none'" in page.headers["content-security-policy"]
    assert_error(http.get(f"{TAKE}/reports/other.html"), 404, "not_found")
    assert_error(http.get(f"{TAKE}/reports/..%2ftake.json"), 404, "not_found")
