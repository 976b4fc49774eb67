"""The link of a camera client to the server: says hello, keeps the clocks, sends frames, comes back.

While the link is down or slow, the newest frames wait in a short queue; older ones are dropped and counted.
"""

import asyncio
import logging
import uuid
from collections import deque
from urllib.parse import urlsplit

from websockets.asyncio.client import ClientConnection, connect
from websockets.exceptions import WebSocketException

from studio import wire
from studio.camera.sources import Source, SourceFrame
from studio.engine.errors import FormatError, SettingsError, StudioError

QUEUE_FRAMES = 60
_FIRST_DELAY_S, _LONGEST_DELAY_S = 0.25, 5.0
_OPEN_TIMEOUT_S = 5.0
_CLOCK_BURST, _BURST_GAP_S, _CLOCK_GAP_S = 8, 0.02, 1.0
_STATUS_GAP_S = 1.0

log = logging.getLogger(__name__)


class RefusedError(StudioError):
    """The server does not take this camera; the message is the server's reason."""


def link_url(server: str) -> str:
    """Return the address of the link on a server, from its http, https, ws or wss address.

    Raises:
        SettingsError: not such an address.
    """
    parts = urlsplit(server if "://" in server else f"http://{server}")
    scheme = {"http": "ws", "ws": "ws", "https": "wss", "wss": "wss"}.get(parts.scheme)
    try:
        usable = scheme is not None and bool(parts.hostname) and (parts.port is None or parts.port > 0)
    except ValueError:  # a port that is no number
        usable = False
    if not usable:
        raise SettingsError(f"server {server!r} is not an address; give one such as http://127.0.0.1:8000")
    path = parts.path.rstrip("/").removesuffix(wire.LINK_PATH)
    return f"{scheme}://{parts.netloc}{path}{wire.LINK_PATH}"


class FrameQueue:
    """Encoded frames on their way; at most `capacity`, the oldest goes first."""

    def __init__(self, capacity: int) -> None:
        self._frames: deque[bytes] = deque()
        self._capacity = capacity
        self._changed = asyncio.Condition()
        self._ended = False
        self.dropped = 0

    async def put(self, frame: bytes, *, wait: bool) -> None:
        """Add a frame: drop the oldest where there is no room, or wait for room."""
        async with self._changed:
            if wait:
                await self._changed.wait_for(lambda: len(self._frames) < self._capacity)
            elif len(self._frames) == self._capacity:
                self._frames.popleft()
                self.dropped += 1
            self._frames.append(frame)
            self._changed.notify_all()

    async def get(self) -> bytes | None:
        """Return the oldest frame, or None once the source has ended and all are gone."""
        async with self._changed:
            await self._changed.wait_for(lambda: self._frames or self._ended)
            frame = self._frames.popleft() if self._frames else None
            self._changed.notify_all()
            return frame

    async def end(self) -> None:
        """Say that no frame comes any more."""
        async with self._changed:
            self._ended = True
            self._changed.notify_all()


class Link:
    """One camera's link; `run` it once.

    Attributes:
        frames_sent: frames handed to the network.
        connections: how often the server has welcomed this camera.
    """

    def __init__(self, source: Source, server: str, *, name: str | None = None, token: str = "") -> None:
        self.url = link_url(server)
        self.name = source.name if name is None else name
        if not wire.is_camera_name(self.name):
            raise SettingsError(
                f"camera name {self.name!r} is not allowed; allowed: 1 to 63 letters, digits, `_`, `.`, `-`"
            )
        self._source = source
        self._hello = wire.Hello(
            protocol_version=wire.PROTOCOL_VERSION,
            name=self.name,
            device=source.device,
            joint_set=source.joint_set,
            boot_id=uuid.uuid4().hex,
            frames_per_second=source.frames_per_second,
            token=token,
        )
        self._queue = FrameQueue(QUEUE_FRAMES)
        self.frames_sent = 0
        self.connections = 0

    async def run(self) -> None:
        """Send the source's frames until it ends, connecting again for ever.

        Raises:
            RefusedError: the server refuses this camera from the start.
            StudioError: the source fails.
        """
        producer = asyncio.create_task(self._produce())
        keeper = asyncio.create_task(self._keep_connected())
        try:
            done, _ = await asyncio.wait((producer, keeper), return_when=asyncio.FIRST_EXCEPTION)
            for task in done:
                task.result()
        finally:
            await _cancel(producer, keeper)

    async def _produce(self) -> None:
        sequence = 0
        async for frame in self._source.frames():
            await self._queue.put(_encode(sequence, frame), wait=not self._source.realtime)
            sequence += 1
        await self._queue.end()

    async def _keep_connected(self) -> None:
        delay_s = _FIRST_DELAY_S
        while True:
            before = self.connections
            try:
                async with connect(
                    self.url,
                    compression=None,
                    max_size=wire.MAX_MESSAGE_BYTES,
                    open_timeout=_OPEN_TIMEOUT_S,
                    close_timeout=1.0,
                    ping_interval=5.0,
                    ping_timeout=10.0,
                    proxy=None,
                ) as socket:
                    await self._session(socket)
                return
            except RefusedError as error:
                if self.connections == 0:
                    raise
                reason = str(error)  # a server that has not noticed yet that the last link is gone
            except (OSError, TimeoutError, WebSocketException, FormatError) as error:
                reason = str(error) or type(error).__name__
            delay_s = _FIRST_DELAY_S if self.connections > before else min(2 * delay_s, _LONGEST_DELAY_S)
            log.warning("camera %s: no link to %s (%s); trying again", self.name, self.url, reason)
            await asyncio.sleep(delay_s)

    async def _session(self, socket: ClientConnection) -> None:
        """Serve one connection; returns when the source has ended and its frames are sent."""
        await socket.send(wire.encode(self._hello))
        answer = await asyncio.wait_for(_receive(socket), _OPEN_TIMEOUT_S)
        if isinstance(answer, wire.Refused):
            raise RefusedError(f"the server refuses camera {self.name}: {answer.reason}")
        if not isinstance(answer, wire.Welcome):
            raise FormatError(f"{self.url} answers hello with {type(answer).__name__}; is it a studio?")
        self.connections += 1
        log.info("camera %s: linked to %s", self.name, self.url)
        frames = asyncio.create_task(self._send_frames(socket))
        others = [
            asyncio.create_task(work(socket)) for work in (self._listen, self._ask_clock, self._send_status)
        ]
        try:
            done, _ = await asyncio.wait((frames, *others), return_when=asyncio.FIRST_COMPLETED)
            for task in done:
                task.result()
            if frames.done():
                await socket.send(wire.encode(self._status()))
        finally:
            await _cancel(frames, *others)

    async def _send_frames(self, socket: ClientConnection) -> None:
        while (frame := await self._queue.get()) is not None:
            await socket.send(frame)
            self.frames_sent += 1

    async def _listen(self, socket: ClientConnection) -> None:
        while True:
            message = await _receive(socket)
            if isinstance(message, wire.ClockReply):
                sample = wire.ClockSample(
                    client_send_ns=message.client_send_ns,
                    server_receive_ns=message.server_receive_ns,
                    server_send_ns=message.server_send_ns,
                    client_receive_ns=self._source.clock_ns(),
                )
                await socket.send(wire.encode(sample))
            elif isinstance(message, wire.Refused):
                raise RefusedError(f"the server refuses camera {self.name}: {message.reason}")

    async def _ask_clock(self, socket: ClientConnection) -> None:
        asked = 0
        while True:
            await socket.send(wire.encode(wire.ClockRequest(client_send_ns=self._source.clock_ns())))
            asked += 1
            await asyncio.sleep(_BURST_GAP_S if asked < _CLOCK_BURST else _CLOCK_GAP_S)

    async def _send_status(self, socket: ClientConnection) -> None:
        while True:
            await socket.send(wire.encode(self._status()))
            await asyncio.sleep(_STATUS_GAP_S)

    def _status(self) -> wire.Status:
        return wire.Status(frames_sent=self.frames_sent, frames_dropped=self._queue.dropped)


def _encode(sequence: int, frame: SourceFrame) -> bytes:
    return wire.encode(
        wire.skeleton_frame(
            sequence,
            frame.device_time_ns,
            frame.positions,
            frame.confidence,
            list(frame.hands),
            frame.head_wxyz,
        )
    )


async def _receive(socket: ClientConnection) -> wire.Message:
    data = await socket.recv()
    if isinstance(data, str):
        raise FormatError("the server sent text; the camera protocol is binary")
    return wire.decode(data)


async def _cancel(*tasks: asyncio.Task[None]) -> None:
    for task in tasks:
        task.cancel()
    await asyncio.gather(*tasks, return_exceptions=True)
