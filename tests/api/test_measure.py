"""The edit list of a solve over the API, and evaluation with the size aligned."""

import numpy as np
import pytest

from studio.engine.metrics.reference.canonical import canonical_positions
from studio.engine.model.joints import CANONICAL
from studio.engine.model.poses import Poses
from studio.engine.model.settings.settings import preset
from studio.take.folder.solves import write_solve
from studio.take.folder.take import Take
from tests.api.test_routes import assert_error
from tests.poses_factory import random_poses

CSV_HEADER = ",".join(["time_s", *(f"{joint}_{axis}" for joint in CANONICAL for axis in "xyz")]) + "\n"


def reference_of(recorded):
    """A still CSV of three joints over the time of the live solve."""
    start_s = Poses.load(recorded.sessions / "tests/one/solves/live/poses.npz").time_s[0]
    rows = "".join(f"{start_s - 1 + i / 30},0,0,1,{i / 900},0,1.5,0.2,0,{1 + i / 900}\n" for i in range(120))
    return "time_s,hips_x,hips_y,hips_z,head_x,head_y,head_z,left_wrist_x,left_wrist_y,left_wrist_z\n" + rows


def test_the_edit_list_of_a_solve(recorded):
    answer = recorded.http.get("/takes/tests/one/solves/live/cleanup")
    assert answer.status_code == 200, answer.text
    found = answer.json()
    assert set(found) == {"cleanup_events_per_min", "cleanup_counts", "cleanup_events"}
    assert sum(found["cleanup_counts"].values()) == len(found["cleanup_events"])
    for event in found["cleanup_events"]:
        assert set(event) == {"kind", "joint", "start_s", "end_s", "peak_s", "size", "unit", "detail"}
    recorded.http.put(
        "/takes/tests/one/references/truth.csv", content=reference_of(recorded)
    ).raise_for_status()
    against = recorded.http.get("/takes/tests/one/solves/live/cleanup", params={"reference": "truth.csv"})
    assert against.status_code == 200, against.text
    assert_error(recorded.http.get("/takes/tests/one/solves/none/cleanup"), 404, "not_found")
    missing = recorded.http.get("/takes/tests/one/solves/live/cleanup", params={"reference": "x.csv"})
    assert_error(missing, 404, "not_found", "reference.send_first")


def test_the_edit_list_is_against_the_reference_as_it_is_kept(recorded):
    """A reference with its own clock is aligned in time too, as in the figures and the report."""
    http, where = recorded.http, "/takes/tests/two"
    poses = random_poses(np.random.default_rng(3), seconds=12.0)
    take = Take.create(recorded.sessions / "tests/two", session="tests", name="two", source="import")
    take.meta["recording"] = "done"
    take.save_meta()
    write_solve(take, "studio", settings=preset("studio"), poses=poses, metrics={}, trace=None)
    reference = CSV_HEADER + "".join(
        ",".join(f"{value:.6f}" for value in (time_s + 0.3, *np.ravel(joints))) + "\n"
        for time_s, joints in zip(poses.time_s, canonical_positions(poses), strict=True)
    )
    http.put(f"{where}/references/truth.csv", content=reference).raise_for_status()
    wanted = {"solve": "studio", "align_time": True}
    http.post(f"{where}/references/truth.csv/align", json=wanted).raise_for_status()
    against = {"reference": "truth.csv"}
    found = http.get(f"{where}/solves/studio/cleanup", params=against).json()
    figures = http.get(f"{where}/solves/studio/figures", params=against).json()
    assert figures["reference"]["time_offset_ms"] == pytest.approx(300, abs=1)
    assert found == {key: figures["reference"][key] for key in found}
    alone = http.get(f"{where}/solves/studio/cleanup").json()
    assert alone == {key: figures["own"][key] for key in alone} != found


def test_a_similarity_is_told(recorded):
    recorded.http.put(
        "/takes/tests/one/references/truth.csv", content=reference_of(recorded)
    ).raise_for_status()
    request = {"reference": "truth.csv", "solves": ["live"], "align": "similarity"}
    answer = recorded.http.post("/takes/tests/one/evaluate", json=request)
    assert answer.status_code == 200, answer.text
    alignment = answer.json()["solves"]["live"]["alignment"]
    assert alignment["kind"] == "similarity" and alignment["scale"] != pytest.approx(1.0)
    request["align"] = "affine"
    assert recorded.http.post("/takes/tests/one/evaluate", json=request).status_code == 422


def test_the_report_is_one_page(recorded):
    recorded.http.put(
        "/takes/tests/one/references/truth.csv", content=reference_of(recorded)
    ).raise_for_status()
    answer = recorded.http.get(
        "/takes/tests/one/report", params={"reference": "truth.csv", "solve": ["live"]}
    )
    assert answer.status_code == 200, answer.text
    assert answer.headers["content-type"].startswith("text/html")
    assert "default-src 'none'" in answer.headers["content-security-policy"]
    assert "<svg" in answer.text and "<script" not in answer.text
    missing = recorded.http.get("/takes/tests/one/report", params={"reference": "x.csv"})
    assert_error(missing, 404, "not_found", "reference.send_first")
