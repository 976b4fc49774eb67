"""Writing a take while it is recorded, on a thread of its own: nothing is dropped, the engine never waits.

What comes is handed to the operating system twenty times a second, so that it outlives this program. A second thread
waits for the disk, which may take long; then `on_synced` hears of it, and the clients are told that they need not
keep those frames any longer.
"""

import logging
import queue
import shutil
import threading
import time
import uuid
from collections.abc import Callable
from datetime import datetime
from pathlib import Path
from typing import Any

from studio.engine.errors import StudioError, TakeError
from studio.engine.frames import CameraFrame, StepResult
from studio.take.pose_log import POSE_LOG, PoseLog
from studio.take.ranges import Ranges
from studio.take.raw import RawWriter
from studio.take.raw_append import RawState
from studio.take.take import Take, timecode
from studio.wire import ENDED, Ack, DepthImage, Hello

_log = logging.getLogger(__name__)

WRITE_S = 0.05
"""A program that is killed loses at most this much of a recording, and the clients send it again."""

FLUSH_S = 0.12
"""How often the disk is waited for: a power cut loses at most this much, and the time that the disk takes."""

RESERVE_BYTES = 32 * 1024 * 1024
"""A recording ends while this much of the disk is left, so that it can be ended in order."""

MAX_GAPS = 1000
MAX_WAITING = 2000
"""Items that may wait for the disk before depth images are left out."""


Key = tuple[str, str]
"""Camera and start of its client (boot id)."""


class Recorder:
    """Writes frames, events and live poses of a take in the order in which they are given.

    Args:
        take: the take that is written.
        state: of its raw file, where it was begun before (`raw_append.scan_raw`).

    Attributes:
        frames: camera frames in the file or on their way to it.
        bytes_written: size of all files so far.
        problem: why writing has stopped, for a person; "" while all is well.
        on_synced: called on a thread of the recorder's with the cameras of which more is on the disk now.
    """

    def __init__(self, take: Take, *, state: RawState | None = None) -> None:
        """Open the files.

        Raises:
            StudioError: they cannot be written.
        """
        self.take = take
        take.meta.setdefault("take_id", uuid.uuid4().hex)
        self._writer = RawWriter(take.raw_path, state=state)
        try:
            self._poses = PoseLog(take.path, ticks=None if state is None else state.ticks)
        except OSError as error:
            self._writer.close()
            raise TakeError(f"cannot write {take.path}: {error.strerror}; free some space") from error
        self.problem = ""
        self.on_synced: Callable[[set[Key]], None] = lambda keys: None
        self.ticks = 0 if state is None else state.ticks
        self._seen: dict[Key, Ranges] = {} if state is None else state.frames
        self.frames = sum(ranges.count for ranges in self._seen.values())
        self.late = 0
        self.duplicates = 0
        self._hellos: dict[Key, Hello] = {} if state is None else dict(state.hellos)
        self._lock = threading.Lock()
        self._synced: dict[Key, Ranges] = {}
        self._kept: dict[Key, tuple[int, int]] = {}
        self._starts: dict[Key, int] = {}
        for key, ranges in self._seen.items():
            self._synced[key] = Ranges()
            for begin, end in ranges:
                self._synced[key].add_range(begin, end)
            self._starts[key] = ranges.first or 0
        self._waiting: list[tuple[Key, int]] = []
        self._written: list[tuple[Key, int]] = []
        self._ended = threading.Event()
        self._queue: queue.SimpleQueue[tuple[Any, ...]] = queue.SimpleQueue()
        self._thread = threading.Thread(target=self._run, name="recorder", daemon=True)
        self._syncer = threading.Thread(target=self._sync, name="recorder disk", daemon=True)
        self._thread.start()
        self._syncer.start()

    @classmethod
    def create(cls, path: Path, *, session: str, name: str) -> "Recorder":
        """Return the recorder of a new take.

        Raises:
            StudioError: the place is taken, cannot be written, or is nearly full; nothing is left behind.
        """
        take = Take.create(path, session=session, name=name, source="live")
        try:
            free = shutil.disk_usage(path).free
            if free < 2 * RESERVE_BYTES:
                raise TakeError(
                    f"only {free >> 20} MB are left on the disk; free some space before recording (at least "
                    f"{2 * RESERVE_BYTES >> 20} MB)"
                )
            take.meta["timecode"] = timecode(datetime.now().astimezone())
            take.meta["number"] = sum(1 for _ in path.parent.glob("*/take.json"))
            take.save_meta()
            return cls(take)
        except StudioError:
            shutil.rmtree(take.path)
            raise

    @property
    def take_id(self) -> str:
        return str(self.take.meta["take_id"])

    # --- from the engine thread

    def camera(self, hello: Hello) -> None:
        """A camera joins; must come before its frames."""
        if (hello.name, hello.boot_id) not in self._hellos:
            self._hellos[hello.name, hello.boot_id] = hello
            self._queue.put(("camera", hello))

    def starts_after(self, hello: Hello, sequence: int | None) -> None:
        """The take begins: frames of this start of a client up to `sequence` do not belong to it."""
        if sequence is not None:
            with self._lock:
                self._starts[hello.name, hello.boot_id] = sequence + 1

    def frame(
        self, hello: Hello, frame: CameraFrame, data: bytes, arrival_ns: int, *, late: bool = False
    ) -> bool:
        """A camera's frame: `data` is the message as it came, `arrival_ns` on the server's clock.

        Returns False where the take has that frame already.
        """
        key = (hello.name, hello.boot_id)
        if not self._seen.setdefault(key, Ranges()).add(frame.sequence):
            self.duplicates += 1
            return False
        self.frames += 1
        self.late += late
        self._hellos.setdefault(key, hello)
        self._queue.put(("late" if late else "frame", hello, frame, data, arrival_ns))
        return True

    def depth(self, hello: Hello, image: DepthImage, data: bytes, arrival_ns: int) -> None:
        """A camera's depth image, from any thread: `data` is the message as it came.

        Left out before `camera`, and while the disk is far behind.
        """
        if (hello.name, hello.boot_id) in self._hellos and self._queue.qsize() < MAX_WAITING:
            self._queue.put(("depth", hello, image, data, arrival_ns))

    def has(self, key: Key, sequence: int) -> bool:
        """Whether the take has this frame already."""
        return key in self._seen and sequence in self._seen[key]

    def event(self, time_ns: int, event: dict[str, Any]) -> None:
        """An event of the live log at a time on the server's clock [ns]."""
        self._queue.put(("event", time_ns, event))

    def tick(self, time_ns: int, event: dict[str, Any], result: StepResult | None) -> None:
        """An output frame that was made: its event and its pose, written together."""
        self._queue.put(("tick", time_ns, event, self.ticks, result))
        self.ticks += 1

    def missing(self) -> dict[str, int]:
        """Frames by camera that lie between those that the take has, or that a client says it keeps."""
        with self._lock:
            kept = dict(self._kept)
        out: dict[str, int] = {}
        for key in {*self._seen, *kept}:
            seen = self._seen.get(key, Ranges())
            ends = [
                bounds
                for bounds in (kept.get(key), (seen.first, seen.last))
                if bounds and bounds[0] is not None
            ]
            if not ends:
                continue
            gaps = seen.gaps(min(first for first, _ in ends), max(last for _, last in ends))
            count = sum(end - begin + 1 for begin, end in gaps)
            if count:
                out[key[0]] = out.get(key[0], 0) + count
        return out

    # --- from any thread

    def keeps(self, key: Key, first: int, last: int) -> None:
        """A client says which frames it keeps."""
        with self._lock:
            first = max(first, self._starts.get(key, first))
            old = self._kept.get(key, (first, last))
            self._kept[key] = (min(first, old[0]), max(last, old[1]))

    def ack(self, key: Key, first: int, *, ended: bool = False) -> Ack:
        """Return what a client that keeps frames from `first` on need not keep; `ended`: no more are recorded."""
        with self._lock:
            first = max(first, self._starts.get(key, first))
            return ack_of(self.take_id, key, self._synced.get(key, Ranges()), first, ended=ended)

    def save_cameras(self) -> None:
        """Write the cameras that have joined into `take.json`; waits for the disk."""
        for hello in list(self._hellos.values()):
            self.take.add_camera(hello)
        self.take.save_meta()

    def close(self) -> None:
        """Write what is left, end the file, and note in `take.json` how the recording ended."""
        self._queue.put(("close",))
        self._thread.join()
        self.take.meta["recording"] = "done"
        self.save_cameras()

    # --- the thread

    def _run(self) -> None:
        written = looked = time.monotonic()
        while True:
            try:
                item = self._queue.get(timeout=WRITE_S)
            except queue.Empty:
                item = None
            try:
                if item is not None and item[0] == "close":
                    self._end()
                    return
                if item is not None and not self.problem:
                    self._write(item)
                now = time.monotonic()
                if not self.problem and now - written >= WRITE_S:
                    self._write_out()
                    written = now
                if not self.problem and now - looked >= FLUSH_S:
                    self._look_at_disk()
                    looked = now
            except (OSError, ValueError, StudioError) as error:
                self._fail(error)
                if item is not None and item[0] == "close":
                    return

    def _fail(self, error: Exception) -> None:
        if self.problem:
            return
        reason = getattr(error, "strerror", None) or str(error)
        self.problem = f"the take cannot be written on ({reason}); free some space, then record again"
        _log.error("%s: %s", self.take.path, self.problem)

    def _look_at_disk(self) -> None:
        free = shutil.disk_usage(self.take.path).free
        if free < RESERVE_BYTES:
            self.problem = (
                f"the disk is nearly full ({free >> 20} MB left): the recording was ended and is kept; free some "
                "space, then record again"
            )
            _log.error("%s: %s", self.take.path, self.problem)

    def _end(self) -> None:
        self._ended.set()
        self._syncer.join()
        try:
            if not self.problem:
                self._write_out()
                self._wait_for_disk()
            self._poses.close()
        finally:
            self._writer.close()

    def _write_out(self) -> None:
        """Poses first: the log never tells of a tick whose pose is not written."""
        self._poses.write_out()
        self._writer.write_out()
        with self._lock:
            self._written += self._waiting
        self._waiting = []

    def _sync(self) -> None:
        """The thread that waits for the disk."""
        while not self._ended.wait(FLUSH_S):
            try:
                if not self.problem:
                    self._wait_for_disk()
            except (OSError, ValueError, StudioError) as error:
                self._fail(error)

    def _wait_for_disk(self) -> None:
        with self._lock:
            written, self._written = self._written, []
        self._poses.sync()
        self._writer.sync()
        with self._lock:
            for key, sequence in written:
                self._synced.setdefault(key, Ranges()).add(sequence)
        if written:
            self.on_synced({key for key, _ in written})

    def _write(self, item: tuple[Any, ...]) -> None:
        kind, *values = item
        if kind in ("frame", "late"):
            hello, frame, data, arrival_ns = values
            if kind == "late":
                self._writer.late_frame(hello, data, arrival_ns=arrival_ns, frame=frame)
            else:
                self._writer.frame(
                    frame.camera,
                    data,
                    arrival_ns=arrival_ns,
                    device_time_ns=frame.device_time_ns,
                    sequence=frame.sequence,
                )
            self._waiting.append(((hello.name, hello.boot_id), frame.sequence))
        elif kind == "depth":
            hello, image, data, arrival_ns = values
            self._writer.depth(
                hello.name,
                data,
                arrival_ns=arrival_ns,
                device_time_ns=image.device_time_ns,
                sequence=image.sequence,
            )
        elif kind == "tick":
            time_ns, event, tick, result = values
            self._writer.event(time_ns, event)
            if result is not None:
                self._poses.add(tick, result)
        elif kind == "event":
            self._writer.event(*values)
        else:
            self._writer.add_camera(*values)

    @property
    def bytes_written(self) -> int:
        paths = (self.take.raw_path, self.take.path / POSE_LOG)
        return sum(path.stat().st_size for path in paths if path.exists())


def ack_of(take_id: str, key: Key, there: Ranges, first: int, *, ended: bool = False) -> Ack:
    """Return what to tell a client that keeps frames from `first` on, when those in `there` are safe."""
    last = max(first - 1 if there.last is None else there.last, first - 1)
    gaps = there.gaps(first, last)
    if len(gaps) > MAX_GAPS:
        return Ack(take_id, key[1], gaps[MAX_GAPS][0] - 1, gaps[:MAX_GAPS])
    return Ack(take_id, key[1], ENDED if ended else last, gaps)
