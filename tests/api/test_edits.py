"""Routes of a take's edits."""

import pytest

from studio.take.edits.kept import read_edits
from studio.take.folder.take import Take
from tests.api.test_routes import assert_error

ROUTE = "/takes/tests/one/edits"


@pytest.fixture
def pin(recorded):
    """A pin at the beginning of the take's solve."""
    from studio.take.edits.check import solved_span

    begins_s, _ = solved_span(Take.open(recorded.sessions / "tests" / "one"))
    return {
        "kind": "pin",
        "joint": "left_wrist",
        "place_m": [0.1, 0.2, 1.1],
        "start_s": begins_s,
        "end_s": begins_s,
    }


def test_edits_are_added_changed_removed_and_taken_back(recorded, pin):
    http = recorded.http
    empty = http.get(ROUTE).json()
    assert (empty["revision"], empty["edits"], empty["can_undo"], empty["can_redo"]) == (0, [], False, False)
    added = http.post(ROUTE, json={"edit": pin})
    assert added.status_code == 201
    (one,) = added.json()["edits"]
    assert (one["id"], one["kind"], one["radius_m"], one["on"]) == ("e1", "pin", 0.0, True)
    changed = http.patch(f"{ROUTE}/e1", json={"edit": {"on": False, "note": "later"}, "revision": 1}).json()
    assert (changed["edits"][0]["on"], changed["edits"][0]["place_m"]) == (False, pin["place_m"])
    assert http.delete(f"{ROUTE}/e1?revision=2").json()["edits"] == []
    back = http.post(f"{ROUTE}/undo").json()
    assert (back["edits"], back["can_redo"]) == (changed["edits"], True)
    assert http.post(f"{ROUTE}/redo", json={"revision": back["revision"]}).json()["edits"] == []
    assert http.put(ROUTE, json={"edits": changed["edits"]}).json()["edits"] == changed["edits"]
    assert http.get(ROUTE).json()["edits"] == changed["edits"]
    assert len(read_edits(Take.open(recorded.sessions / "tests" / "one")).edits) == 1


def test_what_is_wrong_or_stale_is_refused(recorded, pin):
    http = recorded.http
    assert_error(http.post(ROUTE, json={"edit": {**pin, "joint": "tail"}}), 409, "take")
    assert_error(http.post(ROUTE, json={"edit": {"kind": "wish"}}), 409, "take", "edits.not_an_edit")
    assert_error(http.post(ROUTE, json={"pin": pin}), 422, "invalid_request")
    assert_error(http.post(f"{ROUTE}/undo"), 409, "take", "edits.nothing_to_undo")
    assert_error(http.patch(f"{ROUTE}/e9", json={"edit": {"on": False}}), 404, "not_found", "edits.none")
    assert_error(http.delete(f"{ROUTE}/e9"), 404, "not_found", "edits.none")
    http.post(ROUTE, json={"edit": pin}).raise_for_status()
    http.patch(f"{ROUTE}/e1", json={"edit": {"on": False}}).raise_for_status()
    stale = http.patch(f"{ROUTE}/e1", json={"edit": {"on": True}, "revision": 1})
    assert_error(stale, 409, "take", "edits.stale_edit")
    assert_error(http.post(f"{ROUTE}/undo", json={"revision": 1}), 409, "take", "edits.stale")


def test_a_file_of_a_newer_program_is_told(recorded):
    (recorded.sessions / "tests" / "one" / "edits.json").write_text('{"format_version": 9}')
    assert_error(recorded.http.get(ROUTE), 422, "format", "file.version")


def test_a_preview_is_of_a_solve_of_the_take(recorded):
    http = recorded.http
    for ask in (http.post, http.put):
        assert_error(ask(f"{ROUTE}/preview", json={"solve": "nothing"}), 404, "not_found", "take.no_solve")


def test_a_change_that_is_looked_at_at_once_is_not_made_where_it_cannot_be_shown(recorded, pin):
    http = recorded.http
    http.post(ROUTE, json={"edit": pin}).raise_for_status()
    before = http.get(ROUTE).json()
    for ask, path, content in (
        (http.post, "", {"edit": pin}),
        (http.put, "", {"edits": []}),
        (http.patch, "/e1", {"edit": {"on": False}}),
        (http.post, "/undo", {}),
        (http.post, "/redo", {}),
    ):
        assert_error(ask(f"{ROUTE}{path}?look=nothing", json=content), 404, "not_found", "take.no_solve")
    assert_error(http.delete(f"{ROUTE}/e1?look=nothing"), 404, "not_found", "take.no_solve")
    assert http.get(ROUTE).json() == before


def test_offers_need_a_solve_that_says_what_went_into_it(recorded):
    http = recorded.http
    assert_error(http.get(f"{ROUTE}/offers?solve=live"), 409, "take", "offers.no_trace")
    assert_error(http.get(f"{ROUTE}/offers?solve=nothing"), 404, "not_found", "take.no_solve")
