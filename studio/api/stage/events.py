"""The events WebSocket: the status four times a second, and at once when a job has ended, for every open page."""

import asyncio
from collections.abc import Callable
from typing import Any

from fastapi import APIRouter, WebSocket, WebSocketDisconnect
from msgspec import UNSET, Struct, UnsetType

from studio.api.cameras.devices import ConnectedDevice
from studio.api.cameras.local_cameras import LocalCamerasStatus
from studio.api.jobs import Jobs, JobStatus
from studio.api.stage.shown import ReplayStatus, ViewState
from studio.api.structs import encode
from studio.live import LiveStage
from studio.live.states import StageStatus
from studio.triggers.triggers import TriggersStatus

PERIOD_S = 0.25
EVENTS_PATH = "/api/v1/events"


class StatusEvent(Struct, tag="status"):
    """Message to every page, four times a second: status, jobs, and the number of thumbnails made.

    The text `takes` changes when takes are added, removed or renamed, `edits` with the edits of the replayed take.
    `replay`, `edits` and `view` are left out where the server shows no view.
    """

    status: StageStatus
    jobs: list[JobStatus]
    local_cameras: LocalCamerasStatus
    thumbnails: int
    takes: str
    devices: list[ConnectedDevice]
    triggers: TriggersStatus
    replay: ReplayStatus | UnsetType = UNSET
    edits: str | UnsetType = UNSET
    view: ViewState | UnsetType = UNSET


def events_router(
    stage: LiveStage, jobs: Jobs, parts: dict[str, Callable[[], Any]], on_page: Callable[[], None]
) -> APIRouter:
    """Return the route of the events; `parts` make the fields of `StatusEvent` that belong to other rooms, and
    `on_page` is called for each page that is opened."""
    router = APIRouter()

    @router.websocket(EVENTS_PATH)
    async def events(websocket: WebSocket) -> None:
        await websocket.accept()
        on_page()
        gone = asyncio.create_task(wait_until_gone(websocket))
        loop, ended = asyncio.get_running_loop(), asyncio.Event()
        leave = jobs.listen(lambda: loop.call_soon_threadsafe(ended.set))
        news = asyncio.create_task(ended.wait())
        try:
            while not gone.done():
                event = StatusEvent(
                    stage.status(), jobs.list(), **{name: part() for name, part in parts.items()}
                )
                await websocket.send_text(encode(event).decode())
                await asyncio.wait({gone, news}, timeout=PERIOD_S, return_when=asyncio.FIRST_COMPLETED)
                if news.done():
                    ended.clear()
                    news = asyncio.create_task(ended.wait())
        except (WebSocketDisconnect, RuntimeError):
            return  # the page was closed meanwhile
        finally:
            leave()
            gone.cancel()
            news.cancel()

    return router


async def wait_until_gone(websocket: WebSocket) -> None:
    """Return once the page has left; its messages are ignored."""
    while (await websocket.receive())["type"] != "websocket.disconnect":
        pass
