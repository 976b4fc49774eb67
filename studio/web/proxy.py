"""viser on the studio's own port: its one-file client at `/viewer/`, its WebSocket at `/viewer`.

The client opens its WebSocket at its own address without the last slash. Frames are passed on unchanged, except
those of viewers that would move the gizmo; the viser server itself listens on the loopback interface only.
"""

import asyncio
import logging
from functools import cache
from pathlib import Path
from urllib.parse import urlsplit

import viser
from fastapi import APIRouter, WebSocket, WebSocketDisconnect
from fastapi.responses import HTMLResponse, RedirectResponse
from websockets.asyncio.client import ClientConnection, connect
from websockets.exceptions import ConnectionClosed, InvalidHandshake
from websockets.typing import Subprotocol

_log = logging.getLogger(__name__)

MAX_UPSTREAM_BYTES = 1 << 20
"""Largest message from a browser (camera moves are under a kilobyte)."""
MAX_DOWNSTREAM_BYTES = 1 << 26

GIZMO_MESSAGES = b"TransformControls"
"""Prefix of the names of viser's gizmo messages."""

_REFUSED, _TOO_BIG, _GONE = 1008, 1009, 1001

_INSERT = """<style>
html { background: linear-gradient(#d9dde2, #eef0f3); height: 100%; }
html[data-theme=dark] { background: linear-gradient(#1d2126, #2b3138); }
body, #root, #root div[style*="background-color"] { background: none !important; }
.mantine-Paper-root, .mantine-Notifications-root, a[title="About Viser"] { display: none !important; }
</style>
<script src="../static/base/theme.js"></script>
<script src="../static/view/view_times.js"></script>
<script src="../static/view/view_rest.js"></script>
<script src="../static/view/view_resolution.js"></script>
<script src="../static/view/view_pace.js"></script>
<script src="../static/view/view_coarse.js"></script>
<script src="../static/view/view_camera.js"></script>
<script src="../static/view/view_body.js"></script>
<script>
console.warn = ((warn) => (...words) => {
  if (!String(words[0]).startsWith("THREE.Clock:")) warn.apply(console, words);
})(console.warn);
</script>"""
"""Hides viser's panels and notices, and a deprecation notice for viser's own developers; the scene has a backdrop
in the page's theme.
"""


@cache
def client_page() -> str:
    """Return viser's client with its panels hidden, because the studio's page has the controls."""
    page = (Path(viser.__file__).parent / "client" / "build" / "index.html").read_text(encoding="utf-8")
    head, end, rest = page.partition("</head>")
    return head + _INSERT + end + rest


def is_same_origin(origin: str | None, host: str | None) -> bool:
    """Whether a request's `Origin` header names the request's host."""
    return bool(origin) and bool(host) and urlsplit(origin).netloc.lower() == host.lower()


def viewer_routes(viser_port: int) -> APIRouter:
    """Return the routes `/viewer/` (page) and `/viewer` (WebSocket) of a viser server on the loopback."""
    router = APIRouter(include_in_schema=False)

    @router.get("/viewer")
    async def redirect() -> RedirectResponse:
        return RedirectResponse("viewer/")

    @router.get("/viewer/")
    async def page() -> HTMLResponse:
        return HTMLResponse(client_page(), headers={"Cache-Control": "no-cache"})

    @router.websocket("/viewer")
    async def relay(browser: WebSocket) -> None:
        if not is_same_origin(browser.headers.get("origin"), browser.headers.get("host")):
            await browser.close(_REFUSED, "another origin")
            return
        protocols = [Subprotocol(name) for name in browser.scope.get("subprotocols", [])]
        try:
            async with connect(
                f"ws://127.0.0.1:{viser_port}/", subprotocols=protocols or None, compression=None,
                max_size=MAX_DOWNSTREAM_BYTES, proxy=None,
            ) as server:  # fmt: skip
                await browser.accept(subprotocol=server.subprotocol)
                await _relay(browser, server)
        except (OSError, InvalidHandshake) as error:
            _log.warning("the 3D view does not answer: %s", error)
            await browser.close(_GONE, "the 3D view is closed")

    return router


async def _relay(browser: WebSocket, server: ClientConnection) -> None:
    """Pass messages both ways until either side closes, then close the other."""
    looks_only = browser.scope.get("state", {}).get("role") == "viewer"
    up = asyncio.create_task(_upstream(browser, server, looks_only))
    down = asyncio.create_task(_downstream(browser, server))
    try:
        await asyncio.wait((up, down), return_when=asyncio.FIRST_COMPLETED)
    finally:
        for task in (up, down):
            task.cancel()
        await asyncio.gather(up, down, return_exceptions=True)


async def _upstream(browser: WebSocket, server: ClientConnection, looks_only: bool) -> None:
    """Pass on a browser's messages; from one with `looks_only`, none that move the gizmo."""
    try:
        while True:
            message = await browser.receive()
            if message["type"] == "websocket.disconnect":
                return
            data = message.get("bytes") or message.get("text") or b""
            if len(data) > MAX_UPSTREAM_BYTES:
                await browser.close(_TOO_BIG, "message too big")
                return
            if not (looks_only and _is_of_gizmo(data)):
                await server.send(data)
    except ConnectionClosed:
        await _close(browser)


def _is_of_gizmo(data: bytes | str) -> bool:
    """Whether a message of viser's client moves a gizmo: messages contain their names as plain text."""
    return GIZMO_MESSAGES in (data.encode() if isinstance(data, str) else data)


async def _downstream(browser: WebSocket, server: ClientConnection) -> None:
    try:
        async for data in server:
            if isinstance(data, bytes):
                await browser.send_bytes(data)
            else:
                await browser.send_text(data)
    except (WebSocketDisconnect, ConnectionClosed):
        return
    await _close(browser)


async def _close(browser: WebSocket) -> None:
    """Close the browser's side if it is still open."""
    try:
        await browser.close(_GONE)
    except RuntimeError:  # it closed first
        return
