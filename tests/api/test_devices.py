"""Devices of the server's machine by its routes: found, pictured, connected as cameras, released; who may not."""

import io
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import psutil
import pytest
from PIL import Image

from studio.api.access import Access
from studio.api.app import create_app
from studio.camera.client.machine import machine_id
from studio.live import LiveStage
from tests import patient
from tests.api.camera import Camera
from tests.web.stages import serving

Wanted = Callable[[dict[str, Any]], bool]


class Page:
    """What the page asks of a server."""

    def __init__(self, url: str, token: str = "") -> None:
        self.headers = {"Authorization": f"Bearer {token}"} if token else {}
        self.url = url
        self.http = patient.Client(base_url=f"{url}/api/v1", headers=self.headers)

    def devices(self) -> list[dict[str, Any]]:
        return self.http.get("/devices").json()["devices"]

    def search(self) -> dict[str, dict[str, Any]]:
        """Look for devices; return them by their sources."""
        self.http.post("/devices/search").raise_for_status()
        while self.http.get("/devices").json()["searching"]:
            time.sleep(0.1)
        return {one["source"]: one for one in self.devices()}

    def wait(self, device: str, wanted: Wanted) -> dict[str, Any]:
        """Return a device's status once it is as wanted."""
        while True:
            (one,) = [one for one in self.devices() if one["id"] == device]
            if wanted(one):
                return one
            assert one["state"] != "ended", one
            time.sleep(0.1)

    def post(self, device: str, action: str, **body: object) -> Any:
        return self.http.post(f"/devices/{device}/{action}", json=body)

    def camera(self, name: str) -> dict[str, Any]:
        return self.http.get("/status").json()["cameras"].get(name, {})


@pytest.fixture
def start(tmp_path: Path) -> Iterator[Callable[..., Page]]:
    """A function that starts a server; all are closed at the end."""
    stage = LiveStage(tmp_path / "sessions")
    stage.start(prepare=False)
    open_servers, pages = [], []

    def started(access: Access | None = None) -> Page:
        app = create_app(stage, tmp_path / "sessions", access=access)
        server = serving(app)
        open_servers.append((app, server))
        pages.append(Page(server.__enter__(), access.operator_token if access is not None else ""))
        return pages[-1]

    yield started
    for page in pages:
        page.http.close()
    for app, server in open_servers:
        server.__exit__(None, None, None)
        app.state.devices.close()
    stage.close()


def clients(name: str) -> list[psutil.Process]:
    """The processes of clients of a camera's name that this process has started.

    One that has just begun has no command line for a moment, and counts once it has one.
    """
    while any(
        one.is_running() and one.status() != psutil.STATUS_ZOMBIE and not one.cmdline()
        for one in psutil.Process().children()
    ):
        time.sleep(0.01)
    found = [one for one in psutil.Process().children() if one.status() != psutil.STATUS_ZOMBIE]
    return [one for one in found if name in one.cmdline()]


def test_a_device_is_connected_by_a_click_and_let_go(start: Callable[..., Page], access: Access) -> None:
    """Its client has a token of the studio, which asks for them."""
    page = start(access)
    assert page.devices() == []
    found = page.search()
    device = found["simulated-depth:0/2"]
    assert device["state"] == "free" and device["name"] == "simulated_0"
    first, second = (page.post(device["id"], "connect", name="left") for _ in range(2))
    assert first.status_code == second.status_code == 201
    assert len(clients("left")) == 1, "two clicks start one client"
    page.wait(device["id"], lambda one: one["state"] == "connected" and one["camera"] == "left")
    while not page.camera("left").get("frames"):
        time.sleep(0.1)
    assert page.camera("left")["local"] and page.camera("left")["device"].startswith("simulated")
    taken = page.post(found["simulated-depth:1/2"]["id"], "connect", name="left")
    assert taken.status_code == 500 and "'left' is connected already" in taken.json()["error"]["message"]
    refused = page.post(device["id"], "picture")
    assert "the camera 'left' uses this device" in refused.json()["error"]["message"]
    (client,) = clients("left")
    address = page.url.replace("http", "ws") + "/api/v1/events"
    with patient.connect(address, additional_headers=page.headers) as events:
        assert f'"devices":[{{"id":"{device["id"]}","camera":"left","state":"connected"' in events.recv()
    children = [client, *client.children(recursive=True)]
    let_go = page.post(device["id"], "disconnect").json()
    assert let_go["state"] == "free" and let_go["name"] == "left", "the name is kept for the next time"
    psutil.wait_procs(children)
    assert not any(one.is_running() for one in children)
    while page.camera("left")["connected"]:
        time.sleep(0.1)


def test_a_picture_is_taken_once_and_not_while_a_take_is_recorded(start: Callable[..., Page]) -> None:
    page = start()
    device = page.search()["simulated-depth:1/2"]["id"]
    assert page.http.get(f"/devices/{device}/picture").status_code == 404
    taken = page.post(device, "picture").json()
    assert taken["pictures"] == 1 and taken["picture_problem"] == "" and taken["state"] == "free"
    answer = page.http.get(f"/devices/{device}/picture")
    assert answer.headers["content-type"] == "image/png"
    assert Image.open(io.BytesIO(answer.content)).size == (320, 288)
    with Camera(page.url.replace("http", "ws") + "/api/v1/link", 0) as camera:
        camera.greet()
        page.http.post("/record/start", json={}).raise_for_status()
        refused = page.post(device, "picture")
        assert refused.status_code == 409 and "while a take is recorded" in refused.json()["error"]["message"]
        page.http.post("/record/stop").raise_for_status()


def test_a_client_that_ends_says_why(start: Callable[..., Page], paper_sdks: Path) -> None:
    (paper_sdks / "pyorbbecsdk.py").unlink()  # the one that hangs
    page = start()
    device = page.search()["realsense:A1234567"]
    assert (device["device"], device["serial"], device["name"]) == (
        "Paper D435",
        "A1234567",
        "realsense_234567",
    )
    unknown = {one["kind"]: one["problem"] for one in page.http.get("/devices").json()["unknown"]}
    assert "broke off" in unknown["openni"] and "uv sync --extra orbbec" in unknown["orbbec"]
    seen = page.post(device["id"], "picture").json()
    assert seen["picture_problem"] == "the RealSense gives no depth" and seen["pictures"] == 0
    assert page.post(device["id"], "connect").json()["state"] == "starting"
    while (now := page.devices()[0])["state"] == "starting":
        time.sleep(0.1)
    assert now["state"] == "ended" and "the RealSense gives no depth" in now["problem"]
    assert page.post(device["id"], "disconnect").json()["state"] == "free", "the operator has read it"


def test_a_device_of_another_client_is_left_alone(start: Callable[..., Page], paper_sdks: Path) -> None:
    (paper_sdks / "pyorbbecsdk.py").unlink()
    page = start()
    with Camera(page.url.replace("http", "ws") + "/api/v1/link", 0, "by_hand") as camera:
        camera.greet(serial="A1234567", machine=machine_id())
        device = page.search()["realsense:A1234567"]
        assert (device["state"], device["camera"]) == ("in_use", "by_hand")
        for action in ("connect", "picture"):
            refused = page.post(device["id"], action).json()["error"]
            assert "the camera 'by_hand' uses this device" in refused["message"]
        assert refused["said"][0]["code"] == "device.in_use"


def test_only_ids_of_the_list_are_taken(start: Callable[..., Page]) -> None:
    page = start()
    known = page.search()["simulated-depth:0/2"]["id"]
    for device in ("realsense", "simulated-depth:0%2F2", "recording:%2Fetc%2Fpasswd", "x" * 300, known[:-1]):
        for action in ("connect", "disconnect", "picture"):
            assert page.post(device, action).status_code == 404, device
    for name in ("../up", "a b", "-x", "é", "x" * 64):
        assert page.post(known, "connect", name=name).status_code == 422, name
    assert page.post(known, "connect", source="recording:/etc/passwd").status_code == 422
    assert [one["state"] for one in page.devices()] == ["free", "free"]


def test_viewers_see_no_devices(start: Callable[..., Page], access: Access) -> None:
    page = start(access)
    device = page.search()["simulated-depth:0/2"]["id"]
    viewer = {"Cookie": f"studio_operator={access.sign_in(access.renew_viewer(), 'here')}"}
    for method, path in (
        ("GET", ""), ("POST", "/search"), ("GET", f"/{device}/picture"), ("POST", f"/{device}/picture"),
        ("POST", f"/{device}/connect"), ("POST", f"/{device}/disconnect"),
    ):  # fmt: skip
        for headers, status in ((viewer, 403), ({}, 401)):
            asked = patient.request(method, f"{page.url}/api/v1/devices{path}", headers=headers)
            assert asked.status_code == status, (method, path)
