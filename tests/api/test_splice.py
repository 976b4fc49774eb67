"""The route that splices takes."""

import pytest

from studio.take.folder.take import Take
from tests.api.test_routes import assert_error, finished_job


def test_takes_are_spliced_in_the_background(recorded):
    part = {"take": "tests/one", "start_s": 0.0, "end_s": 0.35, "since_begin": True}
    asked = {"take": "tests/loop", "parts": [part, part], "blend_s": 0.1, "near_s": 0.0}
    begun = recorded.http.post("/splices", json=asked)
    assert begun.status_code == 202
    job = finished_job(recorded, begun.json())
    assert (job["kind"], job["state"]) == ("splice", "done"), job
    take = Take.open(recorded.sessions / "tests" / "loop")
    assert take.solve_names() == ["spliced"]
    assert [one["end_s"] - one["start_s"] for one in take.meta.get("parts", [])] == pytest.approx(
        [0.35] * 2, abs=0.03
    )
    assert_error(recorded.http.post("/splices", json=asked), 409, "take", "take.not_empty")


def test_what_cannot_be_spliced_is_told(recorded):
    one = {"take": "tests/one"}
    for asked, status, code in (
        ({"take": "tests/x", "parts": []}, 422, "invalid_request"),
        ({"take": "tests/x", "parts": [{"take": "tests/nothing"}]}, 404, "not_found"),
        ({"take": "x", "parts": [one]}, 409, "take"),
        ({"take": "tests/x", "parts": [one], "blend_s": 99.0}, 422, "invalid_request"),
    ):
        assert_error(recorded.http.post("/splices", json=asked), status, code)
