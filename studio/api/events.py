"""The events WebSocket: the status four times a second, and at once when a job has ended, for every page that
listens."""

import asyncio
from collections.abc import Callable
from typing import Any

from fastapi import APIRouter, WebSocket, WebSocketDisconnect

from studio.api.jobs import Jobs
from studio.live import LiveStage

PERIOD_S = 0.25
EVENTS_PATH = "/api/v1/events"


def events_router(stage: LiveStage, jobs: Jobs, parts: dict[str, Callable[[], Any]]) -> APIRouter:
    """Return the route of the events: `{"type": "status", "status": ..., "jobs": [...]}` and what `parts` return."""
    router = APIRouter()

    @router.websocket(EVENTS_PATH)
    async def events(websocket: WebSocket) -> None:
        await websocket.accept()
        gone = asyncio.create_task(wait_until_gone(websocket))
        loop, ended = asyncio.get_running_loop(), asyncio.Event()
        leave = jobs.listen(lambda: loop.call_soon_threadsafe(ended.set))
        news = asyncio.create_task(ended.wait())
        try:
            while not gone.done():
                message = {"type": "status", "status": stage.status(), "jobs": jobs.list()}
                message.update({name: part() for name, part in parts.items()})
                await websocket.send_json(message)
                await asyncio.wait({gone, news}, timeout=PERIOD_S, return_when=asyncio.FIRST_COMPLETED)
                if news.done():
                    ended.clear()
                    news = asyncio.create_task(ended.wait())
        except (WebSocketDisconnect, RuntimeError):
            return  # the page was closed while it was being told
        finally:
            leave()
            gone.cancel()
            news.cancel()

    return router


async def wait_until_gone(websocket: WebSocket) -> None:
    """Return once the page has left; what it sends is ignored."""
    while (await websocket.receive())["type"] != "websocket.disconnect":
        pass
