"""The two directions of one camera link: messages that wait to be sent, and messages that come too fast."""

import asyncio
import logging
import time

from fastapi import WebSocket, WebSocketDisconnect

from studio import wire

_log = logging.getLogger(__name__)

MESSAGES_PER_S, BURST = 800, 400
"""Largest message rate; a camera of 60 frames a second that also sends kept frames stays below it."""

MAX_PENDING, PAUSE_S = 2000, 0.02
MAX_UNREAD = 256


class Outbox:
    """Messages to one client, sent in order by a separate task."""

    def __init__(self, websocket: WebSocket) -> None:
        self._websocket = websocket
        self._loop = asyncio.get_running_loop()
        self._queue: asyncio.Queue[wire.Message] = asyncio.Queue()
        self._task: asyncio.Task[None] | None = None

    def put(self, message: wire.Message) -> None:
        """Queue a message; safe from any thread, never waits."""
        try:
            self._loop.call_soon_threadsafe(self._add, message)
        except RuntimeError:
            _log.debug("the server is ending; a client is not told")

    def _add(self, message: wire.Message) -> None:
        if self._queue.qsize() < MAX_UNREAD:  # a client that does not read must not fill the memory
            self._queue.put_nowait(message)

    def start(self) -> None:
        self._task = asyncio.create_task(self._run())

    async def _run(self) -> None:
        try:
            while True:
                await self._websocket.send_bytes(wire.encode(await self._queue.get()))
        except (RuntimeError, WebSocketDisconnect):
            return  # the client has left; the reader notices, too

    async def close(self) -> None:
        """Stop sending."""
        if self._task is not None:
            self._task.cancel()
            await asyncio.gather(self._task, return_exceptions=True)


class Throttle:
    """Slows down a client that sends more than any camera does: reading stops, and the network holds it back."""

    def __init__(self) -> None:
        self._allowance = float(BURST)
        self._last_s = time.monotonic()

    async def wait(self, pending: int) -> None:
        """Count a message; wait after too many, or while too many wait in the stage."""
        now = time.monotonic()
        self._allowance = min(BURST, self._allowance + (now - self._last_s) * MESSAGES_PER_S)
        self._last_s = now
        self._allowance -= 1.0
        if self._allowance < 0.0:
            await asyncio.sleep(-self._allowance / MESSAGES_PER_S)
        while pending > MAX_PENDING:
            await asyncio.sleep(PAUSE_S)
            pending -= round(MESSAGES_PER_S * PAUSE_S)
