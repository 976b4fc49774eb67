"""The camera link: one WebSocket per camera client, in the protocol of `studio.wire`."""

import asyncio
import logging

from fastapi import APIRouter, WebSocket, WebSocketDisconnect
from starlette.concurrency import run_in_threadpool

from studio import wire
from studio.api.access import Access
from studio.api.cameras.outbox import Outbox, Throttle
from studio.engine.base.errors import FormatError, StudioError
from studio.engine.base.sentences import say
from studio.live import CameraRefused, LiveStage
from studio.live.cameras.links import CameraLink

_log = logging.getLogger(__name__)

HELLO_TIMEOUT_S = 5.0
_LEFT, _POLICY_VIOLATION, _TOO_BIG = 1006, 1008, 1009

_RECHECK_NS = 1_000_000_000
"""Interval of token checks, after which a camera with a revoked token is disconnected."""


def link_router(stage: LiveStage, access: Access, *, hello_timeout_s: float = HELLO_TIMEOUT_S) -> APIRouter:
    """Return the route of the camera link."""
    router = APIRouter()

    @router.websocket(wire.LINK_PATH)
    async def camera_link(websocket: WebSocket) -> None:
        await websocket.accept()
        link: CameraLink | None = None
        reason, error = say("camera.left", "the client has left"), False
        outbox = Outbox(websocket)
        try:
            link = await _greet(websocket, stage, access, hello_timeout_s, outbox)
            outbox.start()
            stage.recordings.welcomed(link)
            await _follow(websocket, stage, access, link, outbox)
        except WebSocketDisconnect as gone:
            if gone.code == _TOO_BIG:
                reason, error = (
                    say(
                        "camera.message_too_large",
                        "it sent a message above {bytes} bytes",
                        bytes=wire.MAX_MESSAGE_BYTES,
                    ),
                    True,
                )
        except StudioError as refusal:
            stage.refuse(str(refusal))
            if link is not None:
                stage.leave(link, str(refusal), error=True)
            await _refuse(websocket, refusal)
        finally:
            await outbox.close()
            if link is not None:
                stage.leave(link, reason, error=error)

    return router


def _is_local(websocket: WebSocket) -> bool:
    """Whether the client runs on the server's own machine."""
    return websocket.client is not None and websocket.client.host in ("127.0.0.1", "::1")


async def _receive(websocket: WebSocket) -> bytes:
    """Return the next message's bytes.

    Raises:
        FormatError: a text message.
        WebSocketDisconnect: the client has left.
    """
    message = await websocket.receive()
    if message["type"] == "websocket.disconnect":
        raise WebSocketDisconnect(message.get("code", 1000), message.get("reason"))
    data = message.get("bytes")
    if data is None:
        raise FormatError(
            "link.text_of_a_client", "a text message; the camera protocol has binary messages only"
        )
    return data


def _check_token(access: Access, hello: wire.Hello) -> None:
    """Raise CameraRefused if the studio requires a token, and the camera's is not (or no longer) valid, or if the
    camera was released."""
    if access.is_let_go(hello.token):
        raise CameraRefused("token", say("camera.let_go", "the studio has let the camera go"))
    if access.required and access.camera_token_id(hello.token) is None:
        raise CameraRefused(
            "token",
            say(
                "link.no_token",
                "camera {name} has no valid token; make one under Access on the studio's page and "
                "start the camera with --token",
                name=hello.name,
            ),
        )


async def _greet(
    websocket: WebSocket, stage: LiveStage, access: Access, timeout_s: float, outbox: Outbox
) -> CameraLink:
    """Wait for `Hello`, let the camera join, and answer `Welcome`."""
    try:
        data = await asyncio.wait_for(_receive(websocket), timeout_s)
    except TimeoutError as error:
        raise CameraRefused(
            "hello_timeout", say("link.no_hello", "no hello within {seconds:g} s", seconds=timeout_s)
        ) from error
    hello = wire.decode(data)
    if not isinstance(hello, wire.Hello):
        raise FormatError(
            "link.not_hello", "the first message must be hello; got {got}", got=type(hello).__name__
        )
    wire.check_hello(hello)
    _check_token(access, hello)
    local = _is_local(websocket)
    link = await run_in_threadpool(lambda: stage.join(hello, send=outbox.put, local=local))
    try:
        await websocket.send_bytes(wire.encode(wire.Welcome(hello.name, link.reference)))
    except RuntimeError as error:  # it closed the link meanwhile
        stage.leave(link, say("camera.left_early", "the client left before it was welcomed"))
        raise WebSocketDisconnect(_LEFT) from error
    except BaseException:
        stage.leave(link, say("camera.left_early", "the client left before it was welcomed"))
        raise
    return link


async def _follow(
    websocket: WebSocket, stage: LiveStage, access: Access, link: CameraLink, outbox: Outbox
) -> None:
    """Handle the client's messages until it leaves."""
    throttle = Throttle()
    checked_ns = stage.clock_ns()
    while True:
        data = await _receive(websocket)
        arrival_ns = stage.clock_ns()
        if arrival_ns - checked_ns > _RECHECK_NS:
            _check_token(access, link.hello)
            checked_ns = arrival_ns
        match wire.decode(data):
            case wire.SkeletonFrame() as frame:
                stage.frame(link, frame, data, arrival_ns)
            case wire.DepthImage() as image:
                stage.depth(link, image, data, arrival_ns)
            case wire.Preview() as preview:
                stage.previews.take(link, preview)
            case wire.ClockRequest(client_send_ns=sent_ns):
                outbox.put(wire.ClockReply(sent_ns, arrival_ns, stage.clock_ns()))
            case wire.ClockSample() as sample:
                stage.clock_sample(link, sample)
            case wire.Status() as status:
                stage.client_status(link, status)
            case wire.Kept() as kept:
                stage.keeping.kept(link, kept)
            case wire.Late() as late:
                stage.keeping.late(link, late, arrival_ns)
            case other:
                raise FormatError(
                    "link.not_here", "a client does not send {got} here", got=type(other).__name__
                )
        await throttle.wait(stage.pending())


async def _refuse(websocket: WebSocket, error: StudioError) -> None:
    """Send the reason, and close."""
    code = error.refusal if isinstance(error, CameraRefused) else "format"
    try:
        await websocket.send_bytes(wire.encode(wire.Refused(code, str(error))))
        await websocket.close(_POLICY_VIOLATION)
    except (RuntimeError, WebSocketDisconnect):
        _log.debug("a refused camera left before it was told")
