"""A server that is open to the network: who gets in, who does not, and who is put out again."""

import json
import time

import pytest
from websockets.exceptions import InvalidStatus, WebSocketException

from studio import wire
from studio.api.access import Access
from studio.api.access.invitations import new_token
from studio.api.access.tokens import FAILURES_OVER_S, FILE_NAME, MAX_FAILURES
from studio.engine.base.errors import StudioError
from tests import patient
from tests.patient import connect
from tests.refused import refused

HELLO = wire.Hello(wire.PROTOCOL_VERSION, "left", "test", "canonical", "boot")
PAGE = {"Accept": "text/html"}


@pytest.fixture
def studio(open_studio):
    return open_studio


def root(studio) -> str:
    return f"http://127.0.0.1:{studio.port}"


def link(studio, token: str) -> wire.Message:
    """The server's answer to a camera with this token."""
    with connect(studio.url("link")) as socket:
        socket.send(wire.encode(wire.Hello(**{**HELLO_FIELDS, "token": token})))
        return wire.decode(socket.recv(timeout=60))


HELLO_FIELDS = {name: getattr(HELLO, name) for name in HELLO.__struct_fields__}


@pytest.mark.parametrize(
    "path",
    ["status", "takes", "jobs", "switches", "settings", "calibration", "access", "openapi.json", "nothing"],
)
def test_nothing_is_told_without_signing_in(studio, path):
    answer = studio.http.get(path)
    assert answer.status_code == 401
    assert answer.json()["error"]["code"] == "signed_out"


@pytest.mark.parametrize("path", ["record/start", "record/stop", "calibration/start", "access/cameras"])
def test_nothing_is_done_without_signing_in(studio, path):
    assert studio.http.post(path, json={}).status_code == 401


def test_a_browser_is_sent_to_sign_in(studio):
    answer = patient.get(f"{root(studio)}/", headers=PAGE)
    assert answer.status_code == 303
    assert answer.headers["location"] == "/signin?next=/"


def test_sockets_are_closed_without_signing_in(studio):
    with pytest.raises(InvalidStatus), connect(studio.url("events")):
        pass


def test_a_signed_in_browser_gets_everything(studio, access):
    with patient.Client(base_url=root(studio)) as browser:
        answer = browser.post("/api/v1/access/signin", json={"token": access.operator_token})
        assert answer.status_code == 204
        cookie = answer.headers["set-cookie"]
        assert "HttpOnly" in cookie and "samesite=strict" in cookie.lower()
        assert browser.get("/api/v1/status").status_code == 200
        key = browser.cookies["studio_operator"]
        with connect(studio.url("events"), additional_headers={"Cookie": f"studio_operator={key}"}) as socket:
            assert json.loads(socket.recv(timeout=60))["type"] == "status"
        assert browser.post("/api/v1/access/signout").status_code == 204
        browser.cookies.set("studio_operator", key)
        assert browser.get("/api/v1/status").status_code == 401


def test_a_program_sends_the_token(studio, access):
    headers = {"Authorization": f"Bearer {access.operator_token}"}
    assert studio.http.get("status", headers=headers).status_code == 200
    assert studio.http.get("status", headers={"Authorization": "Bearer x"}).status_code == 401
    assert studio.http.get("status", headers={"Authorization": "Basic eDp5"}).status_code == 401


@pytest.mark.parametrize(
    "cookie", ["studio_operator=", "studio_operator=x", "a=b; ;;=", "studio_operator=\u00ff"]
)
def test_wrong_cookies(studio, cookie):
    assert studio.http.get("status", headers={"Cookie": cookie.encode("latin-1")}).status_code == 401


def test_guessing_is_slowed_down(studio, access, clock):
    for _ in range(MAX_FAILURES):
        assert studio.http.post("access/signin", json={"token": "guess"}).status_code == 401
    right = {"token": access.operator_token}
    assert studio.http.post("access/signin", json=right).status_code == 429
    headers = {"Authorization": f"Bearer {access.operator_token}"}
    assert studio.http.get("status", headers=headers).status_code == 401
    clock[0] += FAILURES_OVER_S + 1
    assert studio.http.post("access/signin", json=right).status_code == 204


def test_a_new_operators_token_puts_everybody_out(studio, access):
    headers = {"Authorization": f"Bearer {access.operator_token}"}
    key = access.sign_in(access.operator_token, "here")
    with connect(studio.url("events"), additional_headers={"Cookie": f"studio_operator={key}"}) as socket:
        socket.recv(timeout=60)
        new = studio.http.post("access/operator", headers=headers).json()["token"]
        with pytest.raises(WebSocketException):
            for _ in range(20):
                socket.recv(timeout=60)
    assert studio.http.get("status", headers=headers).status_code == 401
    assert studio.http.get("status", headers={"Authorization": f"Bearer {new}"}).status_code == 200


def test_viewers_look_and_change_nothing(studio, access):
    operator = {"Authorization": f"Bearer {access.operator_token}"}
    made = studio.http.post("access/viewers", headers=operator).json()
    assert made["link"].endswith(f"/signin#{made['token']}")
    key = access.sign_in(made["token"], "here")
    viewer = {"Cookie": f"studio_operator={key}"}
    assert studio.http.get("takes", headers=viewer).status_code == 200
    seen = studio.http.get("access", headers=viewer).json()
    assert (seen["required"], seen["role"], seen["cameras"]) == (True, "viewer", [])
    for method, path in (
        ("POST", "record/start"), ("PUT", "settings"), ("POST", "access/operator"), ("DELETE", "trash"),
        ("GET", "takes/a/b/file"), ("GET", "takes/a/b/solves/c/export?format=bvh"), ("GET", "blind"),
        ("GET", "exports/1"), ("GET", "recordings"),
    ):  # fmt: skip
        answer = studio.http.request(method, path, headers=viewer)
        assert (answer.status_code, answer.json()["error"]["code"]) == (403, "viewer"), path
    with connect(studio.url("events"), additional_headers=viewer) as socket:
        assert "status" in socket.recv(timeout=60)
        studio.http.post("access/viewers", headers=operator)
        with pytest.raises(WebSocketException):
            for _ in range(20):
                socket.recv(timeout=60)
    assert studio.http.get("takes", headers=viewer).status_code == 401


def test_cameras_need_a_token_of_their_own(studio, access):
    assert isinstance(link(studio, ""), wire.Refused)
    assert link(studio, "wrong").code == "token"
    assert link(studio, access.operator_token).code == "token"
    _, token = access.add_camera("laptop")
    assert isinstance(link(studio, token), wire.Welcome)
    headers = {"Authorization": f"Bearer {token}"}
    assert studio.http.get("status", headers=headers).status_code == 401


def test_a_revoked_camera_is_cut_off(studio, access):
    headers = {"Authorization": f"Bearer {access.operator_token}"}
    made = studio.http.post("access/cameras", json={"label": "laptop"}, headers=headers).json()
    assert made["token"] in made["command"]
    with connect(studio.url("link")) as socket:
        socket.send(wire.encode(wire.Hello(**{**HELLO_FIELDS, "token": made["token"]})))
        assert isinstance(wire.decode(socket.recv(timeout=60)), wire.Welcome)
        assert studio.http.delete(f"access/cameras/{made['id']}", headers=headers).status_code == 204
        answer: wire.Message | None = None
        for _ in range(50):
            socket.send(wire.encode(wire.Status(0, 0)))
            time.sleep(0.1)
            try:
                while not isinstance(answer, wire.Refused):
                    answer = wire.decode(socket.recv(timeout=0.01))
            except TimeoutError:
                continue
            break
        assert isinstance(answer, wire.Refused)
    assert studio.http.delete(f"access/cameras/{made['id']}", headers=headers).status_code == 404


def test_only_hashes_are_kept_and_only_for_their_owner(tmp_path, access):
    _, token = access.add_camera("laptop")
    file = tmp_path / "sessions" / FILE_NAME
    assert token not in file.read_text()
    assert access.operator_token not in file.read_text()
    assert file.stat().st_mode & 0o077 == 0
    again = Access(tmp_path / "sessions", required=True, now_s=time.monotonic)
    assert again.camera_token_id(token) is not None
    assert again.operator_token != access.operator_token


def test_a_broken_file_is_said(tmp_path):
    (tmp_path / FILE_NAME).write_text("{")
    with refused(StudioError, "access.tokens_unreadable"):
        Access(tmp_path, required=True, now_s=time.monotonic)


def test_loopback_asks_for_nothing(start_studio, tmp_path):
    open_studio = start_studio(tmp_path / "sessions")
    assert open_studio.http.get("status").status_code == 200
    seen = open_studio.http.get("access").json()
    assert (seen["required"], seen["role"], seen["cameras"], seen["local"]) == (False, "operator", [], True)


def test_tokens_that_somebody_else_keeps(tmp_path):
    given = Access(
        tmp_path, required=True, now_s=time.monotonic, operator_token="o" * 20, camera_token="c" * 20
    )
    assert given.sign_in("o" * 20, "here") and given.camera_token_id("c" * 20) == "given"
    assert given.camera_token_id("") is None and given.camera_token_id("o" * 20) is None
    assert given.renew_operator() != "o" * 20 and given.sign_in("o" * 20, "here") is None
    without = Access(tmp_path, required=True, now_s=time.monotonic)
    assert without.camera_token_id("") is None and without.camera_token_id("c" * 20) is None


def test_a_token_is_never_an_option_of_a_command():
    tokens = [new_token() for _ in range(1000)]  # one of 64 began with a hyphen
    assert len({*tokens}) == 1000 and not any(token.startswith("-") for token in tokens)
