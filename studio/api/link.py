"""The camera link: one WebSocket per camera client, in the protocol of `studio.wire`."""

import asyncio
import logging

from fastapi import APIRouter, WebSocket, WebSocketDisconnect
from starlette.concurrency import run_in_threadpool

from studio import wire
from studio.engine.errors import FormatError, StudioError
from studio.live import CameraRefused, LiveStage
from studio.live.stage import CameraLink

_log = logging.getLogger(__name__)

HELLO_TIMEOUT_S = 5.0
_POLICY_VIOLATION, _TOO_BIG = 1008, 1009


def link_router(stage: LiveStage, *, hello_timeout_s: float = HELLO_TIMEOUT_S) -> APIRouter:
    """Return the route of the camera link."""
    router = APIRouter()

    @router.websocket(wire.LINK_PATH)
    async def camera_link(websocket: WebSocket) -> None:
        await websocket.accept()
        link: CameraLink | None = None
        reason, error = "the client has left", False
        try:
            link = await _greet(websocket, stage, hello_timeout_s)
            await _follow(websocket, stage, link)
        except WebSocketDisconnect as gone:
            if gone.code == _TOO_BIG:
                reason, error = f"it sent a message above {wire.MAX_MESSAGE_BYTES} bytes", True
        except StudioError as refusal:
            stage.refuse(str(refusal))
            if link is not None:
                stage.leave(link, str(refusal), error=True)
            await _refuse(websocket, refusal)
        finally:
            if link is not None:
                stage.leave(link, reason, error=error)

    return router


async def _receive(websocket: WebSocket) -> bytes:
    """Return the next message's bytes.

    Raises:
        FormatError: a text message. WebSocketDisconnect: the client has gone.
    """
    message = await websocket.receive()
    if message["type"] == "websocket.disconnect":
        raise WebSocketDisconnect(message.get("code", 1000), message.get("reason"))
    data = message.get("bytes")
    if data is None:
        raise FormatError("a text message; the camera protocol has binary messages only")
    return data


async def _greet(websocket: WebSocket, stage: LiveStage, timeout_s: float) -> CameraLink:
    """Wait for `Hello`, let the camera join, and answer `Welcome`."""
    try:
        data = await asyncio.wait_for(_receive(websocket), timeout_s)
    except TimeoutError as error:
        raise CameraRefused("hello_timeout", f"no hello within {timeout_s:g} s") from error
    hello = wire.decode(data)
    if not isinstance(hello, wire.Hello):
        raise FormatError(f"the first message must be hello; got {type(hello).__name__}")
    wire.check_hello(hello)
    link = await run_in_threadpool(stage.join, hello)
    try:
        await websocket.send_bytes(wire.encode(wire.Welcome(hello.name, link.reference)))
    except BaseException:
        stage.leave(link, "the client left before it was welcomed")
        raise
    return link


async def _follow(websocket: WebSocket, stage: LiveStage, link: CameraLink) -> None:
    """Take in the client's messages until it leaves; tell it when a recording begins or ends."""
    told: str | None = None
    while True:
        data = await _receive(websocket)
        arrival_ns = stage.clock_ns()
        match wire.decode(data):
            case wire.SkeletonFrame() as frame:
                stage.frame(link, frame, data, arrival_ns)
            case wire.ClockRequest(client_send_ns=sent_ns):
                reply = wire.ClockReply(sent_ns, arrival_ns, stage.clock_ns())
                await websocket.send_bytes(wire.encode(reply))
            case wire.ClockSample() as sample:
                stage.clock_sample(link, sample)
            case wire.Status() as status:
                stage.client_status(link, status)
            case other:
                raise FormatError(f"a client does not send {type(other).__name__} here")
        recording = stage.recording_name()
        if recording != told:
            message = wire.Recording(recording is not None, recording or told or "")
            told = recording
            await websocket.send_bytes(wire.encode(message))


async def _refuse(websocket: WebSocket, error: StudioError) -> None:
    """Say why, and close."""
    code = error.code if isinstance(error, CameraRefused) else "format"
    try:
        await websocket.send_bytes(wire.encode(wire.Refused(code, str(error))))
        await websocket.close(_POLICY_VIOLATION)
    except (RuntimeError, WebSocketDisconnect):
        _log.debug("a refused camera left before it was told")
