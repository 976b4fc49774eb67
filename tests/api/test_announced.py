"""Cameras that wait on the network, with real announcements (mDNS) and real clients: listed, connected by their
code, released; and what strangers announce or answer."""

import secrets
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager, suppress
from pathlib import Path
from typing import Any

import pytest
from zeroconf import IPVersion, ServiceInfo, Zeroconf

from studio.api.access import Access
from studio.api.address import own_address
from studio.api.app import create_app
from studio.camera.waiting.pairing import SERVICE, Pairing, line_of, new_code, read_line
from studio.engine.base.errors import FormatError
from studio.live import LiveStage
from tests import patient
from tests.web.stages import serving

HERE = "127.0.0.1"
OURS = secrets.token_hex(3)
"""Part of the names of this run: other runs on this machine announce theirs on the same interface."""

FAR = f"far-{OURS}"


class Page:
    """What the page asks of a server."""

    def __init__(self, url: str, token: str = "") -> None:
        headers = {"Authorization": f"Bearer {token}"} if token else {}
        self.http = patient.Client(base_url=f"{url}/api/v1", headers=headers)

    def cameras(self) -> dict[str, dict[str, Any]]:
        return {one["name"]: one for one in self.http.get("/devices/announced").json()["cameras"]}

    def wait(self, name: str, state: str | None) -> dict[str, Any]:
        """Return a camera once it is in a state; None: once it is not in the list."""
        while True:
            found = self.cameras().get(name, {})
            if found.get("state") == state:
                return found
            time.sleep(0.1)

    def post(self, camera: str, action: str, **body: str) -> Any:
        return self.http.post(f"/devices/announced/{camera}/{action}", json=body)

    def joined(self, name: str) -> bool:
        return self.http.get("/status").json()["cameras"].get(name, {}).get("connected", False)


@pytest.fixture
def start(tmp_path: Path) -> Iterator[Callable[..., Page]]:
    """A function that starts a server, which has begun to listen; all are closed at the end."""
    stage = LiveStage(tmp_path / "sessions")
    stage.start(prepare=False)
    running = []

    def started(access: Access | None = None, host: str = HERE, *, discover: bool | None = None) -> Page:
        app = create_app(stage, tmp_path / "sessions", access=access, discover=discover)
        server = serving(app)
        url = server.__enter__()
        page = Page(url, access.operator_token if access is not None else "")
        running.append((app, server, page))
        app.state.announced.listen()
        return page

    yield started
    for app, server, page in running:
        page.http.close()
        server.__exit__(None, None, None)
        app.state.devices.close()
        app.state.announced.close()
    stage.close()


@contextmanager
def waiting_client(
    tmp_path: Path, name: str, host: str
) -> Iterator[tuple[subprocess.Popen[str], Callable[[], str]]]:
    """`studio camera --wait`, and a function that returns the next code that it shows."""
    command = [sys.executable, "-m", "studio", "camera", "--source", "simulated:0/1", "--name", name]
    command += ["--wait", host, "--spool", str(tmp_path / "spool")]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as client:

        def code() -> str:
            assert client.stdout is not None
            for line in client.stdout:
                if " code " in line:
                    return line.split()[-1]
            raise AssertionError("the client has ended")

        try:
            yield client, code
        finally:
            client.kill()


def test_a_waiting_camera_comes_by_its_code_and_waits_again_once_it_is_let_go(
    start: Callable[..., Page], tmp_path: Path
) -> None:
    page = start()
    page.http.post("/devices/search").raise_for_status()
    with waiting_client(tmp_path, FAR, HERE) as (client, next_code):
        code = next_code()
        camera = page.wait(FAR, "free")
        assert (camera["kind"], camera["address"]) == ("simulated", HERE)
        wrong = page.post(camera["id"], "connect", code=new_code())
        assert wrong.status_code == 422 and wrong.json()["error"]["said"][0]["code"] == "announced.wrong_code"
        assert page.cameras()[FAR]["state"] == "free" and not page.joined(FAR)
        assert page.post(camera["id"], "connect", code=code.lower().replace("-", " ")).status_code == 201
        page.wait(FAR, "connected")
        assert page.joined(FAR)
        with patient.connect(str(page.http.base_url).replace("http", "ws") + "events") as events:
            assert f'"id":"{camera["id"]}","camera":"{FAR}","state":"connected"' in events.recv()
        assert page.post(camera["id"], "connect", code=code).status_code == 201, (
            "a second click changes nothing"
        )
        page.post(camera["id"], "disconnect").raise_for_status()
        other = next_code()
        assert other != code
        again = page.wait(FAR, "free")
        assert page.post(camera["id"], "connect", code=other).status_code == 404, "that one no longer waits"
        assert page.post(again["id"], "connect", code=code).status_code == 422, "a code is good once"
        client.terminate()
        assert client.wait() == 0
        page.wait(FAR, None)


def test_on_a_studio_with_tokens_the_camera_gets_one_of_its_own(
    start: Callable[..., Page], access: Access, tmp_path: Path
) -> None:
    address = own_address()
    if not address:
        pytest.skip("this machine has no address in a network")
    page = start(access, discover=True)
    known = {one["id"] for one in access.camera_tokens()}
    with waiting_client(tmp_path, FAR, address) as (_, next_code):
        code = next_code()
        camera = page.wait(FAR, "free")
        page.post(camera["id"], "connect", code=new_code())
        assert {one["id"] for one in access.camera_tokens()} == known, "a wrong code leaves no token"
        # the server of the test listens on the loopback alone, so the address that it tells is not reached
        assert page.post(camera["id"], "connect", code=code).status_code == 201
        (token,) = [one for one in access.camera_tokens() if one["id"] not in known]
        assert token["label"] == FAR
        page.post(camera["id"], "disconnect").raise_for_status()
        assert {one["id"] for one in access.camera_tokens()} == known


def test_off_unless_it_is_wanted_where_the_studio_is_open_to_others(
    start: Callable[..., Page], access: Access
) -> None:
    assert start(access).http.get("/devices/announced").json() == {"on": False, "problem": "", "cameras": []}


@contextmanager
def announced(name: str, address: str, port: int, camera: str, kind: str = "realsense") -> Iterator[None]:
    """An announcement on the loopback interface, of whatever a stranger likes."""
    with closing(Zeroconf(interfaces=[HERE], ip_version=IPVersion.V4Only)) as zeroconf:
        zeroconf.register_service(
            ServiceInfo(
                SERVICE, f"{name}-{OURS}.{SERVICE}", port=port, addresses=[socket.inet_aton(address)],
                properties={"name": camera, "kind": kind}, server=f"{name}-{OURS}.local.",
            )
        )  # fmt: skip
        yield
        zeroconf.unregister_all_services()


def test_hostile_announcements_are_not_listed(start: Callable[..., Page]) -> None:
    page = start()
    with (
        announced("one", HERE, 9, f"../{OURS}"),
        announced("two", HERE, 9, f"good-{OURS}", "<b>x</b>"),
        announced("three", "224.0.0.1", 9, f"many-{OURS}"),
        announced("four", "0.0.0.0", 9, f"any-{OURS}"),
        announced("five", HERE, 9, f"last-{OURS}"),
    ):
        camera = page.wait(f"last-{OURS}", "free")
        assert [name for name in page.cameras() if OURS in name] == [f"last-{OURS}"]
        dead = page.post(camera["id"], "connect", code=new_code())
        assert dead.status_code == 500 and "does not answer" in dead.json()["error"]["message"]
    page.wait(f"last-{OURS}", None)


@pytest.mark.parametrize(
    ("greeting", "answer"),
    [
        (line_of(nonce="11"), line_of(proof="00" * 32)),
        (line_of(nonce="11"), b""),
        (b"HTTP/1.1 200 OK\r\n\r\n", b""),
        (b"[" * 5000 + b"\n", b""),
        (b"", b""),
    ],
)
def test_a_stranger_that_does_not_know_the_code_gets_nothing(
    start: Callable[..., Page], greeting: bytes, answer: bytes
) -> None:
    page = start()
    heard: list[bytes] = []
    with socket.create_server((HERE, 0)) as server:

        def talk() -> None:
            link, _ = server.accept()
            with link:
                link.sendall(greeting)
                heard.append(link.recv(4000) if answer else b"")
                link.sendall(answer)

        thread = threading.Thread(target=talk)
        thread.start()
        with announced("stranger", HERE, server.getsockname()[1], f"stranger-{OURS}"):
            camera = page.wait(f"stranger-{OURS}", "free")
            refused = page.post(camera["id"], "connect", code=(code := new_code()))
            assert refused.status_code in (422, 500)
            assert page.cameras()[f"stranger-{OURS}"]["state"] == "free"
        thread.join()
    assert code.encode() not in b"".join(heard) and code.replace("-", "").encode() not in b"".join(heard)


def test_a_caller_that_does_not_know_the_code_moves_no_camera(tmp_path: Path) -> None:
    with (
        waiting_client(tmp_path, FAR, HERE) as (client, next_code),
        closing(Zeroconf(interfaces=[HERE], ip_version=IPVersion.V4Only)) as zeroconf,
    ):
        code = next_code()
        info = zeroconf.get_service_info(SERVICE, f"{FAR}.{SERVICE}", timeout=60_000)
        assert info is not None and info.port is not None
        assert code.encode() not in b"".join(info.text.split()) and set(info.properties) == {b"name", b"kind"}
        evil = "http://192.0.2.66:8000"
        for told in (
            line_of(nonce="22", server=evil, proof="00" * 32),
            line_of(nonce="22", server="file:///etc/passwd", proof="0"),
            line_of(nonce="22"), b"\xff\xfe\n", b"x" * 100_000,
        ):  # fmt: skip
            with socket.create_connection((HERE, info.port)) as link, link.makefile("rb") as lines:
                nonce = read_line(lines.readline())["nonce"]
                with suppress(ConnectionError):  # it hangs up on a long line before all of it was sent
                    link.sendall(told)
                    link.shutdown(socket.SHUT_WR)
                    assert b"proof" not in lines.read()
        # a proof is good for its own server and try
        with socket.create_connection((HERE, info.port)) as link, link.makefile("rb") as lines:
            read_line(lines.readline())
            replayed = Pairing.of(code, nonce, "22", evil)
            link.sendall(line_of(nonce="22", server=evil, proof=replayed.proof("studio")))
            assert b"refused" in lines.readline()
        assert client.poll() is None


def test_what_a_pairing_proves() -> None:
    code = new_code()
    ours = Pairing.of(code, "11", "22", "http://a:1")
    assert ours.proves("studio", Pairing.of(code.lower(), "11", "22", "http://a:1").proof("studio"))
    for other in (
        Pairing.of(new_code(), "11", "22", "http://a:1"), Pairing.of(code, "12", "22", "http://a:1"),
        Pairing.of(code, "11", "23", "http://a:1"), Pairing.of(code, "11", "22", "http://b:1"),
    ):  # fmt: skip
        assert not ours.proves("studio", other.proof("studio"))
    assert not ours.proves("studio", ours.proof("client")) and not ours.proves("studio", None)
    assert ours.token not in (ours.proof("studio"), ours.proof("client")) and len(ours.token) == 64
    assert len(code) == 14 and new_code() != code


@pytest.mark.parametrize(
    "line", [b"", b"{}", b"[]\n", b"{\n", b"\xff\n", b"[" * 1990 + b"\n", b'{"a": "' + b"x" * 3000 + b'"}\n']
)
def test_lines_that_are_none(line: bytes) -> None:
    with pytest.raises(FormatError):
        read_line(line)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--wait"], "--name"),
        (["--wait", "--name", "a b"], "--name"),
        (["--wait", "nowhere", "--name", "a"], "address of this machine"),
        (["--wait", "--name", "a", "--server", "http://x"], "leave them out"),
    ],
)
def test_wrong_use_is_said(options: list[str], words: str) -> None:
    command = [sys.executable, "-m", "studio", "camera", "--source", "simulated:0/1", *options]
    done = subprocess.run(command, capture_output=True, text=True, timeout=120, check=False)
    assert done.returncode == 2 and words in done.stderr and len(done.stderr.splitlines()) == 1
