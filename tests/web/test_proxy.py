"""viser on the studio's port: who may connect, and what happens when a side closes."""

import msgspec
import pytest
import viser
import viser._messages
from fastapi import FastAPI
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import ClientConnection
from websockets.typing import Subprotocol

from studio.web import ViewHandle
from studio.web.proxy import MAX_UPSTREAM_BYTES, _is_of_gizmo, is_same_origin
from tests import patient
from tests.patient import connect
from tests.web.stages import until

PROTOCOL = Subprotocol(f"viser-v{viser.__version__}")


def open_viewer(address: str, origin: str | None) -> ClientConnection:
    return connect(
        address.replace("http", "ws") + "/viewer", origin=origin, subprotocols=[PROTOCOL], max_size=None
    )


def test_client_page_is_served_with_its_panels_hidden(address: str) -> None:
    answer = patient.get(f"{address}/viewer", follow_redirects=True)
    assert answer.status_code == 200 and str(answer.url) == f"{address}/viewer/"
    assert "mantine-Paper-root" in answer.text and "</html>" in answer.text


def test_subprotocol_and_scene_pass_through(address: str) -> None:
    with open_viewer(address, address) as viewer:
        assert viewer.subprotocol == PROTOCOL
        assert len(viewer.recv(timeout=60)) > 100


@pytest.mark.parametrize("origin", [None, "http://elsewhere.example", "http://127.0.0.1", "null"])
def test_other_origins_are_refused_before_the_upgrade(address: str, origin: str | None) -> None:
    with pytest.raises(InvalidStatus, match="403"):
        open_viewer(address, origin)


def test_same_origin_needs_host_and_port() -> None:
    assert is_same_origin("https://Studio.local:8000", "studio.local:8000")
    assert not is_same_origin("https://studio.local", "studio.local:8000")
    assert not is_same_origin("https://studio.local:8000.evil.example", "studio.local:8000")


def test_too_big_a_message_closes_the_link(address: str) -> None:
    with open_viewer(address, address) as viewer:
        viewer.recv(timeout=60)
        viewer.send(b"x" * (MAX_UPSTREAM_BYTES + 1))
        with pytest.raises(ConnectionClosed) as closed:
            while True:
                viewer.recv(timeout=60)
        assert closed.value.rcvd is not None and closed.value.rcvd.code == 1009


def test_closing_the_browser_side_closes_viser_s_side(
    address: str, handle: tuple[ViewHandle, FastAPI]
) -> None:
    live = handle[
        0
    ].view._server._websock_server._live_connections  # viser lists only those that sent a camera
    with open_viewer(address, address) as viewer:
        viewer.recv(timeout=60)
        until(lambda: len(live) == 1)
    until(lambda: len(live) == 0)


def test_closing_the_view_closes_the_browser_side(address: str, handle: tuple[ViewHandle, FastAPI]) -> None:
    with open_viewer(address, address) as viewer:
        viewer.recv(timeout=60)
        handle[0].view.close()
        with pytest.raises(ConnectionClosed):
            while True:
                viewer.recv(timeout=60)
    with pytest.raises((ConnectionClosed, InvalidStatus)):
        with open_viewer(address, address) as viewer:
            viewer.recv(timeout=60)


def test_whoever_only_looks_moves_no_gizmo() -> None:
    for name in ("TransformControlsUpdateMessage", "TransformControlsDragStartMessage"):
        assert hasattr(viser._messages, name) and _is_of_gizmo(msgspec.msgpack.encode({"type": name}))
    assert _is_of_gizmo("TransformControlsDragEndMessage")
    assert not _is_of_gizmo(msgspec.msgpack.encode({"type": "ViewerCameraMessage"}))
