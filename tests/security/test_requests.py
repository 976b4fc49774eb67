"""What a hostile page, program or name may try with the routes: paths, bodies, origins, headers, roles."""

import json
import logging
import socket
import time
from pathlib import Path

import httpx
import pytest
from websockets.exceptions import InvalidStatus

from studio import wire
from studio.api.access import Access
from studio.api.limits import MAX_BODY_BYTES
from studio.server.logs import set_up_logging
from studio.take.raw.frames import read_raw
from tests import patient
from tests.api.camera import Camera
from tests.api.test_routes import assert_error
from tests.patient import connect

OUTSIDE = ["%2e%2e", "..%2f..%2fsecret", "%2e%2e%2f%2e%2e%2fsecret", "..%5csecret", "%2fetc", "a%00.npz"]
FOREIGN = "http://elsewhere.example"


def root(studio) -> str:
    return f"http://127.0.0.1:{studio.port}"


def operations(studio) -> list[tuple[str, str]]:
    """Method and path of every route, from the server's own description."""
    paths = studio.http.get("/openapi.json").json()["paths"]
    return [(method.upper(), path) for path, methods in paths.items() for method in methods]


@pytest.fixture
def guarded(start_studio, tmp_path):
    """A studio that asks for signing in, and its tokens."""
    access = Access(tmp_path / "sessions", required=True, now_s=time.monotonic)
    return start_studio(tmp_path / "sessions", access=access), access


def test_no_name_leads_out_of_the_sessions(recorded):
    secret = recorded.sessions.parent / "secret"
    secret.mkdir()
    (secret / "take.json").write_text("{}")
    (secret / "secret").write_text("the secret")
    before = {path: path.stat().st_mtime_ns for path in recorded.sessions.parent.glob("*")}
    for method, path in operations(recorded):
        for part in (piece for piece in path.split("/") if piece.startswith("{")):
            for name in OUTSIDE:
                address = path.replace(part, name).replace("{session}", "tests").replace("{take}", "one")
                answer = recorded.http.request(method, f"{root(recorded)}{address}", json={})
                assert answer.status_code < 500 and "the secret" not in answer.text, (method, address)
    assert {path: path.stat().st_mtime_ns for path in recorded.sessions.parent.glob("*")} == before


@pytest.mark.parametrize(
    "path", ["../pyproject.toml", "..%2f..%2fapi%2fapp.py", "....//x", "%2e%2e/%2e%2e/app.py"]
)
def test_static_files_are_those_of_the_page(studio, path):
    """Sent over a socket, because an HTTP client would clean up the path."""
    with socket.create_connection(("127.0.0.1", studio.port)) as raw:
        raw.sendall(f"GET /static/{path} HTTP/1.1\r\nHost: 127.0.0.1\r\nConnection: close\r\n\r\n".encode())
        answer = b"".join(iter(lambda: raw.recv(65536), b""))
    assert answer.startswith(b"HTTP/1.1 404"), answer[:200]


@pytest.mark.parametrize("announced", [True, False])
def test_a_body_over_the_limit_is_refused(studio, announced):
    sent = 0

    def endless():
        nonlocal sent
        while sent < 64 * MAX_BODY_BYTES:
            sent += 1 << 16
            yield b" " * (1 << 16)

    content = b" " * (MAX_BODY_BYTES + 1) if announced else endless()
    try:
        answer = studio.http.put("/settings", content=content, headers={"Content-Type": "application/json"})
        assert_error(answer, 413, "too_large", "request.too_large")
    except httpx.WriteError:  # the server hung up before all was sent
        assert not announced
    assert sent < 32 * MAX_BODY_BYTES


def test_a_body_that_lies_about_its_length(studio):
    for length in ("-1", "many", "1e9"):
        with socket.create_connection(("127.0.0.1", studio.port)) as raw:
            raw.sendall(
                f"PUT /api/v1/settings HTTP/1.1\r\nHost: x\r\nContent-Length: {length}\r\n\r\n".encode()
            )
            assert raw.recv(4096).startswith((b"HTTP/1.1 400", b"HTTP/1.1 413"))
    assert studio.http.get("/status").status_code == 200


def test_a_page_of_another_site_changes_nothing(studio):
    """Cross-site request forgery: every route that changes something looks at `Origin`."""
    for method, path in operations(studio):
        if method != "GET":
            answer = studio.http.request(
                method, f"{root(studio)}{path}", json={}, headers={"Origin": FOREIGN}
            )
            assert_error(answer, 403, "origin")


def test_a_form_of_another_site_changes_nothing(studio):
    """A browser sends forms without asking first, as text or as form data, and says `Origin: null` at times."""
    for origin in (
        FOREIGN,
        "null",
        f"http://127.0.0.1:{studio.port + 1}",
        f"https://127.0.0.1:{studio.port}.x",
    ):
        for kind in ("text/plain", "application/x-www-form-urlencoded", "multipart/form-data; boundary=x"):
            headers = {"Origin": origin, "Content-Type": kind}
            assert studio.http.post("/record/start", content=b"{}", headers=headers).status_code == 403
    answer = studio.http.put("/settings", content=b"{}", headers={"Content-Type": "text/plain"})
    assert answer.status_code == 422


def test_reading_changes_nothing(studio):
    """What a page of another site may fetch blindly: no GET of the stage starts, ends or sets anything."""
    before = studio.http.get("/status").json()
    for method, path in operations(studio):
        if method == "GET" and "{" not in path:
            studio.http.get(f"{root(studio)}{path}", headers={"Origin": FOREIGN})
    after = studio.http.get("/status").json()
    assert after["settings"] == before["settings"] and after["calibration"] == before["calibration"]
    assert after["recording"]["active"] is before["recording"]["active"] is False


@pytest.mark.parametrize("path", ["link", "events", "stream"])
@pytest.mark.parametrize("origin", [FOREIGN, "null", "http://127.0.0.1:1"])
def test_sockets_of_other_sites_pages_are_refused(studio, path, origin):
    with pytest.raises(InvalidStatus, match="403"), connect(studio.url(path), origin=origin):
        pass


def test_nothing_of_other_sites_may_be_read_by_them(studio):
    answer = studio.http.get("/status", headers={"Origin": FOREIGN})
    assert not [name for name in answer.headers if name.startswith("access-control")]


def test_answers_are_what_they_say_and_in_no_other_sites_frame(studio):
    for path in ("/api/v1/status", "/api/v1/nothing", "/api/v1/openapi.json", "/health"):
        headers = studio.http.get(f"{root(studio)}{path}").headers
        assert headers["x-content-type-options"] == "nosniff"
        assert headers["x-frame-options"] == "SAMEORIGIN"


def test_no_name_makes_a_header(recorded):
    (recorded.sessions / "tests" / "one").rename(recorded.sessions / "tests" / "one, ü; x=y")
    for name in ("a%0d%0aSet-Cookie: x=1", "a%0aX-Evil: 1", "one%2C ü%3B x%3Dy"):
        for address in (f"/rigs/{name}", f"/takes/tests/{name}"):
            headers = recorded.http.get(address).headers
            assert "set-cookie" not in headers and "x-evil" not in headers
    assert "filename*=utf-8''one%2C%20%C3%BC%3B%20x%3Dy.take.zip" in headers_of_file(recorded)


def headers_of_file(studio) -> str:
    return studio.http.get("/takes/tests/one, ü; x=y/file").headers["content-disposition"]


def test_a_redirect_stays_on_this_site(guarded):
    studio, _ = guarded
    for path in ("//elsewhere.example/x", "/%0d%0aSet-Cookie:%20x=1", "/\\elsewhere.example"):
        answer = patient.get(root(studio) + path, headers={"Accept": "text/html"})
        assert answer.headers.get("location", "/signin?next=").startswith("/signin?next=")
        assert "set-cookie" not in answer.headers


PHONES = "/api/v1/phones"
"""Asks for an invitation of its own: `test_phones.py`."""
VIDEOS = "/api/v1/video"
"""Asks for a camera's token, as below."""


def test_a_video_comes_with_a_token_of_a_camera_only(guarded):
    studio, access = guarded
    _, camera = access.add_camera("laptop")
    viewer = access.sign_in(access.renew_viewer(), "here")
    for method, path in (("POST", VIDEOS), ("PUT", f"{VIDEOS}/x?at=0")):
        for headers in ({}, {"Authorization": "Bearer x"}, {"Cookie": f"studio_operator={viewer}"}):
            assert (
                studio.http.request(method, root(studio) + path, json={}, headers=headers).status_code == 401
            )
        answer = studio.http.request(
            method, root(studio) + path, json={}, headers={"Authorization": f"Bearer {camera}"}
        )
        assert answer.status_code in (200, 422)


def test_who_watches_or_votes_or_is_a_camera_operates_nothing(guarded):
    """Without the operator's token every route that changes something is closed, whatever else one may have."""
    studio, access = guarded
    _, camera = access.add_camera("laptop")
    open_ = {"/api/v1/access/signin", PHONES}
    every = operations_of(studio, access)
    for headers in (
        {},
        {"Authorization": f"Bearer {camera}"},
        {"Cookie": f"studio_operator={camera}"},
        {"X-Voter": "x"},
    ):
        for method, path in every:
            if path not in open_ and not path.startswith(("/api/v1/vote/", VIDEOS)):
                answer = studio.http.request(method, root(studio) + path, json={}, headers=headers)
                assert answer.status_code in ((200,) if path == "/health" else (401,)), (method, path)
        for path in ("events", "stream"):
            with pytest.raises(InvalidStatus), connect(studio.url(path), additional_headers=headers):
                pass


def test_a_viewer_changes_nothing(guarded):
    """Whoever signed in by a viewer's link is refused by every route that changes something, but signing out."""
    studio, access = guarded
    key = access.sign_in(access.renew_viewer(), "here")
    headers = {"Cookie": f"studio_operator={key}"}
    assert studio.http.get("/status", headers=headers).status_code == 200
    before = studio.http.get("/status", headers=headers).json()
    for method, path in operations_of(studio, access):
        if (
            method != "GET"
            and "/vote/" not in path
            and not (path.endswith(("/signin", "/signout", PHONES)) or path.startswith(VIDEOS))
        ):
            answer = studio.http.request(method, root(studio) + path, json={}, headers=headers)
            assert answer.status_code == 403, (method, path, answer.status_code)
    after = studio.http.get("/status", headers=headers).json()
    assert after["settings"] == before["settings"] and after["recording"]["active"] is False


def operations_of(studio, access: Access) -> list[tuple[str, str]]:
    headers = {"Authorization": f"Bearer {access.operator_token}"}
    paths = studio.http.get("/openapi.json", headers=headers).json()["paths"]
    return [(method.upper(), path) for path, methods in paths.items() for method in methods]


def test_secrets_are_in_no_log_and_in_no_file(guarded, capfd):
    studio, access = guarded
    set_up_logging("text", "debug")
    try:
        _, camera = access.add_camera("laptop")
        key = access.sign_in(access.operator_token, "here")
        with Camera(studio.url("link"), 0) as client:
            client.greet(token=camera)
            headers = {"Authorization": f"Bearer {access.operator_token}", "Cookie": f"studio_operator={key}"}
            studio.http.post(
                "/record/start", json={"session": "a", "take": "b"}, headers=headers
            ).raise_for_status()
            for _ in range(5):
                client.send_frame()
            time.sleep(0.2)
            studio.http.post("/record/stop", headers=headers).raise_for_status()
        studio.http.post("/access/signin", json={"token": "wrong-secret"})
        studio.http.get("/status", headers={"Authorization": "Bearer wrong-secret"})
        studio.http.put(
            "/settings", json={"preset": "wrong-secret-x"}, headers={"Authorization": "Bearer nothing"}
        )
        with connect(studio.url("link")) as link:
            link.send(
                wire.encode(
                    wire.Hello(wire.PROTOCOL_VERSION, "x", "t", "canonical", "b", token="wrong-secret")
                )
            )
            link.recv(timeout=60)
    finally:
        logging.basicConfig(force=True, handlers=[])
    said = "".join(capfd.readouterr())
    for secret in (access.operator_token, access.own_camera_token, camera, key, "wrong-secret"):
        assert secret not in said
        for path in studio.sessions.rglob("*"):
            assert not path.is_file() or secret.encode() not in path.read_bytes(), path
    raw = Path(studio.sessions / "a" / "b" / "raw.mcap")
    assert camera not in json.dumps([repr(record) for record in read_raw(raw)])
