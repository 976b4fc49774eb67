"""Frames that come after their take has ended: a link was down when it was stopped, a client was started again.

A thread of its own opens the take, writes what it lacks, waits for the disk, and tells the client. Frames taken
after the end of the take are settled without being written.
"""

import logging
import queue
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from studio.engine.errors import StudioError, TakeError
from studio.engine.frames import CameraFrame, ClockModel
from studio.live import log
from studio.live.recorder import FLUSH_S, Key, ack_of
from studio.take.ranges import Ranges
from studio.take.raw import RawWriter
from studio.take.raw_append import RawState, scan_raw
from studio.take.sessions import find_take
from studio.take.take import Take
from studio.wire import Ack, Hello

_log = logging.getLogger(__name__)

CLOSE_S = 2.0
RETRY_S = 1.0
END_NS = 50_000_000
"""A frame so much after the end of its take may still belong to it: clocks are not exact."""

Reply = Callable[[Ack], None]


@dataclass
class _Request:
    """Of one client: which frames it keeps (`frame` None), or one of them."""

    take_id: str
    hello: Hello
    reply: Reply
    first: int = 0
    frame: CameraFrame | None = None
    data: bytes = b""
    arrival_ns: int = 0


@dataclass
class _Open:
    """A take that late frames are written to."""

    take: Take
    writer: RawWriter
    state: RawState
    clients: dict[Key, tuple[int, Reply]] = field(default_factory=dict)
    changed: set[Key] = field(default_factory=set)
    hellos: dict[Key, Hello] = field(default_factory=dict)
    used_s: float = 0.0
    written: int = 0


class LateTakes:
    """Takes in frames of takes that are not being recorded; methods may be called from any thread."""

    def __init__(self, sessions: Path) -> None:
        self._sessions = sessions
        self._queue: queue.SimpleQueue[_Request | None] = queue.SimpleQueue()
        self._open: dict[str, _Open] = {}
        self._thread = threading.Thread(target=self._run, name="late frames", daemon=True)

    def start(self) -> None:
        self._thread.start()

    def close(self) -> None:
        """Finish the takes that are open."""
        if self._thread.is_alive():
            self._queue.put(None)
            self._thread.join()

    def kept(self, take_id: str, hello: Hello, first: int, reply: Reply) -> None:
        """A client keeps frames of a take: tell it which the take has."""
        self._queue.put(_Request(take_id, hello, reply, first))

    def frame(
        self, take_id: str, hello: Hello, frame: CameraFrame, data: bytes, arrival_ns: int, reply: Reply
    ) -> None:
        """A kept frame has come."""
        self._queue.put(_Request(take_id, hello, reply, 0, frame, data, arrival_ns))

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
                    threading.Timer(RETRY_S, self._queue.put, (request,)).start()
            if time.monotonic() - flushed >= FLUSH_S:
                self._flush()
                flushed = time.monotonic()
        for take_id in list(self._open):
            self._finish(take_id)

    def _take_in(self, request: _Request) -> None:
        opened = self._opened(request.take_id)
        if opened is None:
            request.reply(Ack(request.take_id, request.hello.boot_id, request.first - 1, known=False))
            return
        key = (request.hello.name, request.hello.boot_id)
        opened.used_s = time.monotonic()
        if request.frame is None:
            there = opened.state.frames.get(key)
            begin = request.first if there is None or there.first is None else max(request.first, there.first)
            opened.clients[key] = (begin, request.reply)
            opened.changed.add(key)
            return
        sequence = request.frame.sequence
        if opened.state.frames.setdefault(key, Ranges()).add(sequence):
            if _belongs(opened.state, key, request.frame):
                opened.hellos[key] = request.hello
                opened.written += 1
                opened.writer.late_frame(
                    request.hello, request.data, arrival_ns=request.arrival_ns, frame=request.frame
                )
        opened.changed.add(key)

    def _opened(self, take_id: str) -> _Open | None:
        if take_id in self._open:
            return self._open[take_id]
        path = find_take(self._sessions, take_id)
        if path is None:
            return None
        take = Take.open(path)
        state = scan_raw(take.raw_path)
        self._open[take_id] = _Open(
            take, RawWriter(take.raw_path, state=state), state, used_s=time.monotonic()
        )
        return self._open[take_id]

    def _flush(self) -> None:
        for take_id, opened in list(self._open.items()):
            try:
                opened.writer.flush()
            except TakeError as error:
                _log.error("late frames of %s: %s", opened.take.path, error)
                self._finish(take_id)
                continue
            for key in opened.changed:
                if key in opened.clients:
                    first, reply = opened.clients[key]
                    reply(ack_of(take_id, key, opened.state.frames.get(key, Ranges()), first))
            opened.changed.clear()
            if time.monotonic() - opened.used_s > CLOSE_S:
                self._finish(take_id)

    def _finish(self, take_id: str) -> None:
        opened = self._open.pop(take_id)
        try:
            opened.writer.close()
            for hello in opened.hellos.values():
                opened.take.add_camera(hello)
            opened.take.save_meta()
        except StudioError as error:
            _log.error("late frames of %s: %s", opened.take.path, error)
        if opened.written:
            _log.info("%d late frames were added to %s", opened.written, opened.take.path)


def _belongs(state: RawState, key: Key, frame: CameraFrame) -> bool:
    """Whether a frame was taken before its take ended, as far as the take's log can tell."""
    stopped = state.last_event("stopped")
    end_ns = None if stopped is None else stopped.get("stage_time_ns")
    clock = _clock(state.events, key)
    if end_ns is None or clock is None:
        return True
    return clock.stage_ns(frame.device_time_ns) <= end_ns + END_NS


def _clock(events: list[tuple[int, dict[str, Any]]], key: Key) -> ClockModel | None:
    """The last clock of a camera's start in a live log."""
    for _, event in reversed(events):
        if event.get("type") == "clock" and event.get("camera") == key[0]:
            if str(event.get("clock_id", "")).split("#")[0] == key[1]:
                return log.clock_of(event)
    return None
