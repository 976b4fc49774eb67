"""The link of a camera client to the server: hello, clock exchanges, frames, reconnection.

While the link is down or slow, the newest frames wait in a short queue; older ones are dropped and counted. Frames
of a recording are also in the spool (`keeper`), and lost ones are sent again between the new ones.
"""

import asyncio
import logging
import time
import uuid
from collections.abc import Mapping
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

from websockets.asyncio.client import ClientConnection, connect
from websockets.exceptions import WebSocketException

from studio import wire
from studio.camera.client.frame_queue import FrameQueue
from studio.camera.client.keeper import Keeper
from studio.camera.client.machine import machine_id, usb_controller
from studio.camera.client.spool import Spool
from studio.camera.client.trust import trusting
from studio.camera.client.video import VideoRecorder
from studio.camera.client.video_sender import VideoSender
from studio.camera.client.workload import Workload
from studio.camera.sources.source import Source, SourceFrame
from studio.engine.base.errors import FormatError, SettingsError, StudioError
from studio.engine.base.sentences import Said, Value, say
from studio.engine.base.value_sentences import bad_value

QUEUE_FRAMES = 60
DEPTH_FRAMES = 10
"""Depth images that wait while the link is slow; they are sent during a recording, and not kept."""
_FIRST_DELAY_S, _LONGEST_DELAY_S = 0.25, 5.0
_OPEN_TIMEOUT_S = 5.0
_CLOCK_BURST, _BURST_GAP_S, _CLOCK_GAP_S = 8, 0.02, 1.0
_STATUS_GAP_S = 1.0
_PREVIEW_GAP_S = 0.05
_PREVIEW_WAITING = 2
"""Maximum number of waiting frames at which previews are sent; none are sent while kept frames wait."""
_LATE_BATCH, _LATE_PAUSE_S = 10, 0.02
"""Kept frames are sent in batches, about 500 a second, so that new ones are not delayed."""
_SYNC_GAP_S = 1.0
_NAME_TAKEN_S = 7.0
"""Wait after a refused name; the server needs 5 s to notice that an earlier start of this camera has vanished."""
_ACK_WAIT_S = 5.0
_CLOSE_S, _LAST_READ_S = 1.0, 10.0
"""How long a server may take to close the link; and if the source has ended, until it has read the last frames."""

log = logging.getLogger(__name__)


def _plain(values: Mapping[str, Value]) -> dict[str, str | int | float]:
    """Return the values of a sentence as the protocol has them."""
    return {name: one if isinstance(one, int | float) else str(one)[:500] for name, one in values.items()}


class RefusedError(StudioError):
    """The server refuses this camera; the message is the server's reason, `refusal` is for programs."""

    def __init__(self, message: str, code: str) -> None:
        super().__init__(message)
        self.refusal = code


def link_url(server: str) -> str:
    """Return the address of the link on a server, from its http, https, ws or wss address.

    Raises:
        SettingsError: it is not such an address.
    """
    parts = urlsplit(server if "://" in server else f"http://{server}")
    scheme = {"http": "ws", "ws": "ws", "https": "wss", "wss": "wss"}.get(parts.scheme)
    try:
        usable = scheme is not None and bool(parts.hostname) and (parts.port is None or parts.port > 0)
    except ValueError:  # the port is no number
        usable = False
    if not usable:
        raise SettingsError(
            "link.server",
            "server {server!r} is not an address; give one such as http://127.0.0.1:8000",
            server=server,
        )
    path = parts.path.rstrip("/").removesuffix(wire.LINK_PATH)
    return f"{scheme}://{parts.netloc}{path}{wire.LINK_PATH}"


def video_url(link: str) -> str:
    """Return the address to which a client uploads its videos, from the address of its link."""
    return "http" + link.removeprefix("ws").removesuffix(wire.LINK_PATH) + wire.VIDEO_PATH


class Link:
    """One camera's link; `run` it once.

    Args:
        source: of the frames.
        server: address of the studio.
        name: of the camera; the source's where None.
        token: the studio's token for cameras.
        spool: keeps frames of recordings until they are on the server's disk; None: they are not kept.
        drop_unknown: delete kept frames of takes that the server lacks.
        until_let_go: end once the server no longer accepts the token.
        certificate: the server's own, if the system does not trust it; see `trusting`.
        video: records the source's video during takes; None: it is not recorded.

    Attributes:
        frames_sent: number of frames sent as they came.
        frames_late: number of kept frames sent again.
        connections: number of the server's welcomes.
    """

    def __init__(
        self,
        source: Source,
        server: str,
        *,
        name: str | None = None,
        token: str = "",
        spool: Spool | None = None,
        drop_unknown: bool = False,
        until_let_go: bool = False,
        certificate: Path | None = None,
        video: VideoRecorder | None = None,
    ) -> None:
        self.url = link_url(server)
        self.name = source.name if name is None else name
        if not wire.is_camera_name(self.name):
            raise SettingsError(
                bad_value("camera name", repr(self.name), "1 to 63 letters, digits, `_`, `.`, `-`")
            )
        self._source = source
        self._until_let_go = until_let_go
        tls = None if certificate is None or not self.url.startswith("wss:") else trusting(certificate)
        self._tls: dict[str, Any] = {} if tls is None else {"ssl": tls}
        self._hello = wire.Hello(
            protocol_version=wire.PROTOCOL_VERSION,
            name=self.name,
            device=source.device,
            joint_set=source.joint_set,
            boot_id=uuid.uuid4().hex,
            serial=source.serial,
            machine=machine_id(),
            usb_controller=usb_controller(source.serial),
            frames_per_second=source.frames_per_second,
            intrinsics=source.intrinsics,
            token=token,
        )
        self._depth: dict[int, bytes] = {}
        self._recording = False
        self._queue = FrameQueue(QUEUE_FRAMES)
        self._workload = Workload(lambda: source.tracked_ns)
        self._spool = spool
        self._video = video
        self._video_sender = None if video is None else VideoSender(
            video.spool, video_url(self.url), token, tls, lambda: not video.recording
        )  # fmt: skip
        self._keeper = Keeper(spool, self._hello, self._queue.wake, drop_unknown=drop_unknown)
        self.frames_sent = 0
        self.frames_late = 0
        self.connections = 0

    async def run(self) -> None:
        """Send the source's frames until it ends, reconnecting without limit.

        Raises:
            RefusedError: the server refuses this camera at the first connection, or has released it.
            StudioError: the source fails.
        """
        producer = asyncio.create_task(self._produce())
        connector = asyncio.create_task(self._keep_connected())
        syncer = asyncio.create_task(self._sync_spool())
        videos = [] if self._video_sender is None else [asyncio.create_task(self._video_sender.run())]
        try:
            done, _ = await asyncio.wait((producer, connector), return_when=asyncio.FIRST_EXCEPTION)
            for task in done:
                task.result()
        finally:
            await _cancel(producer, connector, syncer, *videos)
            if self._video is not None:
                await asyncio.to_thread(self._video.stop)

    async def _sync_spool(self) -> None:
        while self._spool is not None:
            await asyncio.sleep(_SYNC_GAP_S)
            await asyncio.to_thread(self._spool.sync)

    async def _produce(self) -> None:
        sequence = 0
        async for frame in self._source.frames():
            data = _encode(sequence, frame)
            self._keeper.frame(sequence, data)
            if frame.depth_mm is not None and self._recording:
                image = wire.depth_image(sequence, frame.device_time_ns, frame.depth_mm)
                self._depth[sequence] = wire.encode(image)
                self._depth.pop(sequence - DEPTH_FRAMES, None)
            dropped = await self._queue.put(sequence, data, wait=not self._source.realtime)
            if dropped is not None:
                self._keeper.dropped(dropped)
            sequence += 1
        self._queue.end()

    async def _keep_connected(self) -> None:
        delay_s = _FIRST_DELAY_S
        refused_until = time.monotonic() + _NAME_TAKEN_S
        while True:
            before = self.connections
            try:
                async with connect(
                    self.url,
                    compression=None,
                    max_size=wire.MAX_MESSAGE_BYTES,
                    open_timeout=_OPEN_TIMEOUT_S,
                    close_timeout=_CLOSE_S,
                    ping_interval=5.0,
                    ping_timeout=10.0,
                    proxy=None,
                    **self._tls,
                ) as socket:
                    await self._session(socket)
                    socket.close_timeout = _LAST_READ_S
                return
            except RefusedError as error:
                taken = error.refusal == "name_taken" and time.monotonic() < refused_until
                let_go = self._until_let_go and error.refusal == "token"
                if let_go or (self.connections == 0 and not taken):
                    raise
                reason = str(error)  # the server has not yet noticed the end of the last link
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
            raise RefusedError(
                say(
                    "link.refused",
                    "the server refuses camera {name}: {reason}",
                    name=self.name,
                    reason=answer.reason,
                ),
                answer.code,
            )
        if not isinstance(answer, wire.Welcome):
            raise FormatError(
                "link.not_a_studio",
                "{url} answers hello with {got}; is it a studio?",
                url=self.url,
                got=type(answer).__name__,
            )
        self.connections += 1
        log.info("camera %s: linked to %s", self.name, self.url)
        await self._say(socket, self._keeper.connected())
        frames = asyncio.create_task(self._send_frames(socket))
        others = [
            asyncio.create_task(work(socket))
            for work in (self._listen, self._ask_clock, self._send_status, self._send_previews)
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
        """Send new frames as they come, and kept ones in between; return when all are sent."""
        ended_s: float | None = None
        while True:
            item = self._queue.pop()
            if item is not None:
                sequence, data = item
                begin_ns = time.monotonic_ns()
                await socket.send(data)
                self._workload.sent(begin_ns)
                self._keeper.sent(sequence)
                if (image := self._depth.pop(sequence, None)) is not None:
                    await socket.send(image)
                self.frames_sent += 1
            elif self._keeper.has_late:
                await self._send_late(socket)
            elif self._queue.ended:
                ended_s = time.monotonic() if ended_s is None else ended_s
                if self._keeper.owed == 0 or time.monotonic() - ended_s > _ACK_WAIT_S:
                    return
                await asyncio.sleep(_LATE_PAUSE_S)
            else:
                await self._queue.wait()

    async def _send_late(self, socket: ClientConnection) -> None:
        for _ in range(_LATE_BATCH):
            late = self._keeper.next_late()
            if late is None:
                return
            await socket.send(wire.encode(late))
            self.frames_late += 1
        await asyncio.sleep(_LATE_PAUSE_S)

    @staticmethod
    async def _say(socket: ClientConnection, messages: list[wire.Kept]) -> None:
        for message in messages:
            await socket.send(wire.encode(message))

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
                raise RefusedError(
                    say(
                        "link.refused",
                        "the server refuses camera {name}: {reason}",
                        name=self.name,
                        reason=message.reason,
                    ),
                    message.code,
                )
            elif isinstance(message, wire.Recording):
                self._recording = message.active
                await self._say(socket, self._keeper.recording_changed(message))
                if self._video is not None:
                    start = self._hello.boot_id, self._keeper.newest + 1
                    await asyncio.to_thread(self._video.recording_changed, message, self.name, *start)
            elif isinstance(message, wire.Ack):
                await self._say(socket, self._keeper.acknowledged(message))

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

    async def _send_previews(self, socket: ClientConnection) -> None:
        """Send the newest depth image, reduced, twenty times a second while the link is free."""
        shown_ns = -1
        while True:
            await asyncio.sleep(_PREVIEW_GAP_S)
            newest = self._source.newest_depth
            busy = len(self._queue) > _PREVIEW_WAITING or self._keeper.has_late or self._keeper.problem
            if newest is not None and newest[0] != shown_ns and not busy:
                shown_ns = newest[0]
                await socket.send(wire.encode(wire.preview_image(*newest)))

    def _status(self) -> wire.Status:
        processor, sending = self._workload.shares()
        video = "" if self._video is None else self._video.problem
        problem = self._keeper.problem or self._source.problem or video
        said = problem if isinstance(problem, Said) else None
        return wire.Status(
            frames_sent=self.frames_sent,
            frames_dropped=self._queue.dropped,
            message=problem[:500],
            frames_kept=self._keeper.owed,
            frames_not_kept=self._keeper.refused,
            frames_unknown=self._keeper.unknown,
            processor_percent=processor,
            sending_percent=sending,
            message_code="" if said is None else said.code,
            message_values={} if said is None else _plain(said.values),
        )


def _encode(sequence: int, frame: SourceFrame) -> bytes:
    time_ns = frame.device_time_ns
    if frame.picture is not None:
        return wire.encode(wire.landmark_frame(sequence, time_ns, frame.picture, frame.confidence))
    first, *others = (
        wire.skeleton_frame(
            sequence, time_ns, one.positions, one.confidence, list(one.hands), one.head_wxyz, body=one.body
        )
        for one in (frame, *frame.others)
    )
    return wire.encode(wire.with_others(first, others) if others else first)


async def _receive(socket: ClientConnection) -> wire.Message:
    data = await socket.recv()
    if isinstance(data, str):
        raise FormatError("link.text_of_the_server", "the server sent text; the camera protocol is binary")
    return wire.decode(data)


async def _cancel(*tasks: asyncio.Task[None]) -> None:
    for task in tasks:
        task.cancel()
    await asyncio.gather(*tasks, return_exceptions=True)
