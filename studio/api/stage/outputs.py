"""Routes of live output: UDP targets, and the stream of frames over a WebSocket."""

import asyncio
from collections import deque
from typing import TYPE_CHECKING, Annotated, Literal

from fastapi import APIRouter, WebSocket, WebSocketDisconnect
from msgspec import Struct
from pydantic import Field

from studio.api.errors import RESPONSES, NotFoundError
from studio.api.stage.events import wait_until_gone
from studio.api.stage.stage import Request
from studio.api.structs import StructRoute
from studio.engine.base.errors import StudioError
from studio.live import LiveStage
from studio.streams import Cast, Outputs, OutputStatus, joint_targets, steps_of
from studio.streams.frames import frame_message, head_message
from studio.streams.robot_sender import JointThread
from studio.streams.targets import RATES_HZ

if TYPE_CHECKING:
    from studio.engine.robots.body.robot import Robot

STREAM_PATH = "/api/v1/stream"
MAX_WAITING = 3
"""Messages of joint targets that wait for a slow receiver; older ones are dropped."""

SOON = 0.75
"""A frame is too early for the rate if less than this share of a period has passed since the last."""

Rate = Annotated[float, Field(ge=1, le=120, description="frames a second at most [Hz]; of a robot 50 to 100")]
Port = Annotated[
    int, Field(ge=0, le=65535, description="UDP port; 0: the one that receivers usually listen on")
]
Scale = Annotated[float, Field(ge=0.01, le=100, description="positions are multiplied by this")]


class OutputRequest(Request):
    """A new target of the live motion."""

    kind: Literal["vmc", "rokoko", "robot"] = Field(
        description="VMC over OSC, Rokoko's JSON v3, or a robot's joint targets"
    )
    host: str = Field("127.0.0.1", description="the machine that receives", examples=["192.168.1.20"])
    port: Port = 0
    rate_hz: Rate = 60.0
    scale: Scale = 1.0
    actor: str = Field("Performer", description="name of the character")
    performer: str = Field(
        "",
        description="name of the performer whose motion is sent; empty: of all (rokoko), of the first (vmc)",
    )
    robot: str = Field("", description="name of the kept robot, of the kind `robot`", examples=["g1"])
    enabled: bool = True


class OutputChange(Request):
    """Changes of a target; other attributes stay."""

    host: str | None = None
    port: Port | None = None
    rate_hz: Rate | None = None
    scale: Scale | None = None
    actor: str | None = None
    performer: str | None = None
    robot: str | None = None
    enabled: bool | None = None


class LiveOutputs(Struct):
    """All targets, and why the stored ones cannot be read, or empty."""

    outputs: list[OutputStatus]
    problem: str


def outputs_router(stage: LiveStage, outputs: Outputs) -> APIRouter:
    """Return the routes of live output; docs/streaming.md describes WebSocket `/api/v1/stream?rate_hz=60`."""
    router = APIRouter(prefix="/api/v1", tags=["live output"], responses=RESPONSES, route_class=StructRoute)

    @router.get("/outputs")
    def get_outputs() -> LiveOutputs:
        """All targets, with the frames sent and dropped and the last error."""
        return LiveOutputs(outputs.list(), outputs.problem)

    @router.post("/outputs", status_code=201)
    def add_output(request: OutputRequest) -> OutputStatus:
        """Send the live motion to another program, from now on, also after a restart."""
        return _one(outputs, outputs.create(**request.model_dump()).id)

    @router.patch("/outputs/{output}")
    def change_output(output: str, request: OutputChange) -> OutputStatus:
        """Change a target, or switch it on or off."""
        _one(outputs, output)
        outputs.change(output, **request.model_dump(exclude_none=True))
        return _one(outputs, output)

    @router.delete("/outputs/{output}")
    def remove_output(output: str) -> dict[str, str]:
        """Remove a target."""
        _one(outputs, output)
        outputs.remove(output)
        return {"deleted": output}

    @router.websocket(STREAM_PATH.removeprefix("/api/v1"))
    async def stream(
        websocket: WebSocket, rate_hz: float = 60.0, performer: str = "", robot: str = ""
    ) -> None:
        low_hz, high_hz = joint_targets.RATES_HZ if robot else RATES_HZ
        if robot:
            await websocket.accept()  # so that the receiver reads the reason
        if not low_hz <= rate_hz <= high_hz:
            reason = f"rate_hz={rate_hz:g} is not allowed; allowed: {low_hz:g} to {high_hz:g}"
            await websocket.close(4422, reason)
            return
        if robot:
            try:
                model = await asyncio.to_thread(outputs.robot, robot)
            except StudioError as error:
                await websocket.close(4422, str(error)[:120])
                return
            await _stream_joints(websocket, stage, outputs.cast, rate_hz, performer, model)
            return
        await websocket.accept()
        await _stream(websocket, stage, outputs.cast, 1.0 / rate_hz, performer)

    return router


async def _stream(
    websocket: WebSocket, stage: LiveStage, cast: Cast, period_s: float, performer: str
) -> None:
    """Send the newest frame when the rate allows, of the performer of a name, "" = of all; a slow receiver misses
    frames."""
    loop, fresh = asyncio.get_running_loop(), asyncio.Event()
    gone = asyncio.create_task(wait_until_gone(websocket))
    gone.add_done_callback(lambda _: fresh.set())
    unsubscribe = stage.subscribe(lambda _: loop.call_soon_threadsafe(fresh.set))
    sent_ns = None
    try:
        await websocket.send_text(head_message())
        while not gone.done():
            await fresh.wait()
            fresh.clear()
            _, result = stage.results.get()
            if result is None:
                continue
            time_ns = result.frame_set.stage_time_ns
            if sent_ns is None or not 0 <= time_ns - sent_ns < SOON * 1e9 * period_s:
                sent_ns = time_ns
                steps = steps_of(result, cast(), performer)
                if steps:
                    await websocket.send_text(frame_message(steps))
    except (WebSocketDisconnect, RuntimeError):
        return  # the receiver left meanwhile
    finally:
        unsubscribe()
        gone.cancel()


async def _stream_joints(
    websocket: WebSocket, stage: LiveStage, cast: Cast, rate_hz: float, performer: str, robot: "Robot"
) -> None:
    """Send a robot's joint targets at a rate; a slow receiver misses some."""
    loop, fresh = asyncio.get_running_loop(), asyncio.Event()
    gone = asyncio.create_task(wait_until_gone(websocket))
    gone.add_done_callback(lambda _: fresh.set())
    waiting: deque[bytes] = deque(maxlen=MAX_WAITING)

    def send(message: bytes) -> None:
        waiting.append(message)
        loop.call_soon_threadsafe(fresh.set)

    thread = JointThread(lambda: robot, rate_hz, cast, performer, send)
    unsubscribe = stage.subscribe(thread.add)
    try:
        while not gone.done():
            await fresh.wait()
            fresh.clear()
            while waiting:
                await websocket.send_text(waiting.popleft().decode())
    except (WebSocketDisconnect, RuntimeError):
        return  # the receiver left meanwhile
    finally:
        unsubscribe()
        gone.cancel()
        await asyncio.to_thread(thread.close)


def _one(outputs: Outputs, output: str) -> OutputStatus:
    """Return one target.

    Raises:
        NotFoundError: there is none of that id.
    """
    for value in outputs.list():
        if value.id == output:
            return value
    raise NotFoundError("output.none", "there is no live output {id!r}", id=output)
