"""Frames that arrive after the end of their take: a link was down when it ended, or a client was started again.

A separate thread reads the take's log, which decides whether a frame belongs to the recording (`take.membership`). A
frame that does is written and synced to the disk, and the client is told. A frame that does not is settled without
being written, and the server's log gives the number and the reason; the take does not change.
"""

import logging
import queue
import threading
import time
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

from studio.engine.base.errors import StudioError, TakeError
from studio.engine.model.frames import CameraFrame
from studio.live.recording.owed import ack_of
from studio.live.recording.recorder import FLUSH_S
from studio.take.folder.take import Take
from studio.take.library.sessions import find_take
from studio.take.raw.append import scan_raw
from studio.take.raw.frames import RawWriter
from studio.take.raw.membership import STRANGER, Key, Membership
from studio.take.raw.ranges import Ranges
from studio.wire import ENDED, Ack, Hello

_log = logging.getLogger(__name__)

CLOSE_S = 2.0
RETRY_S = 1.0
RETRIES = 60
"""A take that is not ready after this many tries was left by a crash; clients keep their frames until they connect
again."""

Reply = Callable[[Ack], None]


@dataclass
class _Request:
    """A client's request: the frames that it keeps (`frame` None), or one of them."""

    take_id: str
    hello: Hello
    reply: Reply
    first: int = 0
    last: int = -1
    frame: CameraFrame | None = None
    data: bytes = b""
    arrival_ns: int = 0
    tries: int = 0

    @property
    def key(self) -> Key:
        return self.hello.name, self.hello.boot_id


@dataclass
class _OpenTake:
    """A take with late frames; `settled` frames are in it, or do not belong to it."""

    take: Take
    membership: Membership
    settled: dict[Key, Ranges]
    writer: RawWriter | None = None
    clients: dict[Key, tuple[int, Reply]] = field(default_factory=dict)
    changed: set[Key] = field(default_factory=set)
    used_s: float = 0.0
    written: Counter[str] = field(default_factory=Counter)
    refused: Counter[tuple[str, str]] = field(default_factory=Counter)


class LateTakes:
    """Records frames of takes that are no longer being recorded; methods may be called from any thread."""

    def __init__(self, sessions: Path) -> None:
        self._sessions = sessions
        self._queue: queue.SimpleQueue[_Request | None] = queue.SimpleQueue()
        self._open: dict[str, _OpenTake] = {}
        self._thread = threading.Thread(target=self._run, name="late frames", daemon=True)

    def start(self) -> None:
        self._thread.start()

    def close(self) -> None:
        """Finish the takes that are open."""
        if self._thread.is_alive():
            self._queue.put(None)
            self._thread.join()

    def kept(self, take_id: str, hello: Hello, first: int, last: int, reply: Reply) -> None:
        """Handle a client that keeps frames of a take: tell it which the take has."""
        self._queue.put(_Request(take_id, hello, reply, first, last))

    def frame(
        self, take_id: str, hello: Hello, frame: CameraFrame, data: bytes, arrival_ns: int, reply: Reply
    ) -> None:
        """Handle a kept frame."""
        sequence = frame.sequence
        self._queue.put(_Request(take_id, hello, reply, sequence, sequence, frame, data, arrival_ns))

    # --- the thread

    def _run(self) -> None:
        flushed = time.monotonic()
        while True:
            request: _Request | None = None
            try:
                request = self._queue.get(timeout=FLUSH_S)
                if request is None:
                    break
                self._take_in(request)
            except queue.Empty:
                pass
            except StudioError as error:
                _log.warning("late frames are not taken in yet: %s", error)
                if request is not None and request.frame is None:
                    self._later(request)
            if time.monotonic() - flushed >= FLUSH_S:
                self._flush()
                flushed = time.monotonic()
        for take_id in list(self._open):
            self._finish(take_id)

    def _later(self, request: _Request) -> None:
        request.tries += 1
        if request.tries > RETRIES:
            request.reply(_unknown(request))
        else:
            retry = threading.Timer(RETRY_S, self._queue.put, (request,))
            retry.daemon = True
            retry.start()

    def _take_in(self, request: _Request) -> None:
        opened = self._opened(request.take_id)
        if opened is None:
            request.reply(_unknown(request))
            return
        key = request.key
        opened.used_s = time.monotonic()
        if not opened.membership.joined(key):
            opened.refused[key[0], STRANGER] += max(0, request.last - request.first + 1)
            request.reply(Ack(request.take_id, key[1], ENDED))
            return
        if request.frame is None:
            opened.clients[key] = (max(request.first, opened.membership.first(key)), request.reply)
        elif request.frame.sequence not in opened.settled.setdefault(key, Ranges()):
            self._judge(opened, request, request.frame)
            opened.settled[key].add(request.frame.sequence)
        opened.changed.add(key)

    def _judge(self, opened: _OpenTake, request: _Request, frame: CameraFrame) -> None:
        """Write a frame that belongs to the take and is missing in it."""
        key = request.key
        reason = opened.membership.refusal(key, frame.sequence, frame.device_time_ns)
        if reason:
            opened.refused[key[0], reason] += 1
            return
        if opened.writer is None:  # the take does not change before this
            opened.writer = RawWriter(opened.take.raw_path, state=scan_raw(opened.take.raw_path))
        opened.writer.late_frame(request.hello, request.data, arrival_ns=request.arrival_ns, frame=frame)
        opened.written[key[0]] += 1

    def _opened(self, take_id: str) -> _OpenTake | None:
        """Return a take that has ended, None where there is none.

        Raises:
            StudioError: it is being written, or cannot be read.
        """
        if take_id in self._open:
            return self._open[take_id]
        path = find_take(self._sessions, take_id)
        if path is None:
            return None
        take = Take.open(path)
        if take.meta["recording"] == "recording":
            raise TakeError(
                "take.being_recorded",
                "{path} is being recorded or saved; `studio doctor` ends what a crash left",
                path=path,
            )
        state = scan_raw(take.raw_path)
        try:
            membership = Membership(state)
        except (KeyError, TypeError, ValueError) as error:
            raise TakeError(
                "take.log_unreadable",
                "the log of {path} cannot be read: {error!r}; run `studio doctor {path}`",
                path=path,
                error=error,
            ) from error
        self._open[take_id] = _OpenTake(take, membership, state.frames, used_s=time.monotonic())
        return self._open[take_id]

    def _flush(self) -> None:
        for take_id, opened in list(self._open.items()):
            try:
                if opened.writer is not None:
                    opened.writer.flush()
            except TakeError as error:
                _log.error("late frames of %s: %s", opened.take.path, error)
                self._finish(take_id)
                continue
            for key in opened.changed:
                if key in opened.clients:
                    first, reply = opened.clients[key]
                    reply(_ack(take_id, key, opened, first))
            opened.changed.clear()
            if time.monotonic() - opened.used_s > CLOSE_S:
                self._finish(take_id)

    def _finish(self, take_id: str) -> None:
        opened = self._open.pop(take_id)
        try:
            if opened.writer is not None:
                opened.writer.close()
        except StudioError as error:
            _log.error("late frames of %s: %s", opened.take.path, error)
        for camera, count in opened.written.items():
            _log.info("%d late frames of %s were added to %s", count, camera, opened.take.path)
        for (camera, reason), count in opened.refused.items():
            _log.warning(
                "%d frames of %s were not taken into %s: %s", count, camera, opened.take.path, reason
            )


def _unknown(request: _Request) -> Ack:
    return Ack(request.take_id, request.hello.boot_id, request.first - 1, known=False)


def _ack(take_id: str, key: Key, opened: _OpenTake, first: int) -> Ack:
    """Acknowledgement for a client: it may drop all frames once the take is complete up to a frame from after its
    end."""
    settled, after = opened.settled.get(key, Ranges()), opened.membership.ends_before(key)
    if after is not None and not settled.gaps(first, after - 1):
        return Ack(take_id, key[1], ENDED)
    return ack_of(take_id, key, settled, first)
