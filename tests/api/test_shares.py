"""Share links over real HTTP: made, listed, opened without signing in, taken back; nothing else opens with them."""

import pytest

from studio.api.access import Access
from tests import patient
from tests.web.playback.takes import take_with_solves


@pytest.fixture
def take(studio):
    return take_with_solves(studio.sessions / "monday" / "one")


def test_a_solve_is_shared_and_taken_back(studio, take) -> None:
    answer = studio.http.post("/takes/monday/one/solves/studio/share", json={"title": "A <walk>"})
    assert answer.status_code == 201, answer.text
    share = answer.json()
    assert studio.http.get("/shares").json() == [share]
    again = studio.http.post("/takes/monday/one/solves/studio/share", json={"title": "A <walk>"})
    assert again.json() == share
    root = f"http://127.0.0.1:{studio.port}"
    page = patient.get(root + share["path"])
    assert page.status_code == 200 and "A &lt;walk&gt;" in page.text
    rules = page.headers["content-security-policy"]
    assert "sandbox allow-scripts;" in rules and "default-src 'none'" in rules
    assert "'sha256-" in rules and "allow-same-origin" not in rules and "connect-src" not in rules
    assert page.headers["referrer-policy"] == "no-referrer" and page.headers["cache-control"] == "no-store"
    file = studio.http.get(f"/shares/{share['id']}/file")
    assert file.headers["content-disposition"] == 'attachment; filename="A_walk.html"'
    assert file.content == page.content and len(page.content) == share["size_bytes"]
    assert studio.http.get(f"/shares/{share['id']}/qr").headers["content-type"] == "image/svg+xml"
    assert studio.http.delete(f"/shares/{share['id']}").status_code == 200
    assert patient.get(root + share["path"]).status_code == 404
    assert studio.http.post(f"/shares/{share['id']}/restore").json() == share
    assert patient.get(root + share["path"]).status_code == 200
    studio.http.delete(f"/shares/{share['id']}").raise_for_status()
    gone = patient.get(root + share["path"])
    assert (
        gone.status_code == 404
        and "leads to no replay" in gone.text
        and studio.http.get("/shares").json() == []
    )


@pytest.mark.parametrize(
    ("path", "body", "status"),
    [
        ("monday/one/solves/nothing", {}, 404),
        ("monday/two/solves/studio", {}, 404),
        ("monday/one/solves/studio", {"start_s": 50}, 422),
        ("monday/one/solves/studio", {"start_s": -1}, 422),
        ("monday/one/solves/studio", {"colour": "red"}, 422),
        ("monday/one/solves/studio", {"title": "x" * 300}, 422),
    ],
)
def test_what_cannot_be_shared_is_refused(studio, take, path, body, status) -> None:
    assert studio.http.post(f"/takes/{path}/share", json=body).status_code == status
    assert studio.http.get("/shares").json() == []


def test_nobody_signs_in_for_a_replay_and_it_opens_nothing_else(start_studio, tmp_path) -> None:
    access = Access(tmp_path / "sessions", required=True, now_s=lambda: 0.0)
    studio = start_studio(tmp_path / "sessions", access=access)
    take_with_solves(studio.sessions / "monday" / "one")
    signed_in = {"Authorization": f"Bearer {access.operator_token}"}
    assert studio.http.post("/takes/monday/one/solves/studio/share").status_code == 401
    share = studio.http.post("/takes/monday/one/solves/studio/share", headers=signed_in).json()
    root = f"http://127.0.0.1:{studio.port}"
    assert patient.get(root + share["path"]).status_code == 200
    assert patient.get(root + "/share/guess").status_code == 404
    assert studio.http.get("/shares").status_code == 401
    assert studio.http.get(f"/shares/{share['id']}/file").status_code == 401
    assert studio.http.delete(f"/shares/{share['id']}").status_code == 401
    assert patient.get(f"{root}/share/../api/v1/takes").status_code == 401
