"""Writes a take during its recording, on a separate thread: no frame is dropped, and the engine never waits.

Data is passed to the operating system twenty times a second, so that it outlives this program. A second thread
syncs the disk, which may take long, and then calls `on_synced`; the clients learn that they need not
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

from studio.engine.base.errors import StudioError, TakeError
from studio.engine.base.file_sentences import unwritable
from studio.engine.base.sentences import say, system_says
from studio.engine.model.frames import CameraFrame, StepResult
from studio.live.recording.owed import Owed
from studio.take.folder.take import Take, timecode
from studio.take.raw.append import RawState
from studio.take.raw.frames import RawWriter
from studio.take.raw.live_log import JoinedEvent, LiveEvent
from studio.take.raw.membership import Key
from studio.take.raw.pose_log import PoseLogs
from studio.take.raw.ranges import Ranges
from studio.wire import DepthImage, Hello

_log = logging.getLogger(__name__)

WRITE_S = 0.05
"""Interval of writes: the most of a recording that a killed program loses; the clients send it again."""

FLUSH_S = 0.12
"""Interval of disk syncs: a power cut loses at most this much, plus the time of the sync."""

RESERVE_BYTES = 32 * 1024 * 1024
"""A recording ends when this much of the disk is left, so that it can be completed."""

MAX_WAITING = 2000
"""Most items waiting for the disk before depth images are left out."""


class Recorder:
    """Writes frames, events and live poses of a take in the order in which they are given.

    Args:
        take: the take to write.
        state: of its raw file, if it was begun before (`raw_append.scan_raw`).

    Attributes:
        frames: number of camera frames in the file or on their way to it.
        bytes_written: size of all files so far.
        problem: why writing has stopped, for a person; "" = no problem.
        owed: the frames that clients keep, and which are on the disk.
        take_id: names the take for good.
        on_synced: called on a thread of the recorder's with the cameras that have more frames on the disk now.
    """

    def __init__(self, take: Take, *, state: RawState | None = None) -> None:
        """Open the files.

        Raises:
            StudioError: they cannot be written.
        """
        self.take = take
        self.take_id = take.meta.setdefault("take_id", uuid.uuid4().hex)
        self._writer = RawWriter(take.raw_path, state=state)
        try:
            self._poses = PoseLogs(take.path, ticks=None if state is None else state.ticks)
        except OSError as error:
            self._writer.close()
            raise TakeError(unwritable(take.path, error)) from error
        self.problem = ""
        self.on_synced: Callable[[set[Key]], None] = lambda keys: None
        self.ticks = 0 if state is None else state.ticks
        self._seen: dict[Key, Ranges] = {} if state is None else state.frames
        self.frames = sum(ranges.count for ranges in self._seen.values())
        self.late = 0
        self.duplicates = 0
        self._hellos: dict[Key, Hello] = {} if state is None else dict(state.hellos)
        self.owed = Owed(self.take_id, state)
        self._writing: dict[str, str] = {}
        self._lock = threading.Lock()
        self._waiting: list[tuple[Key, int]] = []
        self._written: list[tuple[Key, int]] = []
        self._ended = threading.Event()
        self._queue: queue.SimpleQueue[tuple[Any, ...]] = queue.SimpleQueue()
        self._thread = threading.Thread(target=self._run, name="recorder", daemon=True)
        self._syncer = threading.Thread(target=self._sync, name="recorder disk", daemon=True)
        self._thread.start()
        self._syncer.start()

    @classmethod
    def create(cls, path: Path, *, session: str, name: str, timecode_rate: str | None = None) -> "Recorder":
        """Return the recorder of a new take; `timecode_rate`: of the timecode that comes in, None = none does.

        Raises:
            StudioError: the place is taken, cannot be written, or is nearly full; nothing is left behind.
        """
        take = Take.create(path, session=session, name=name, source="live")
        try:
            free = shutil.disk_usage(path).free
            if free < 2 * RESERVE_BYTES:
                raise TakeError(
                    "recording.disk_low",
                    "only {mb} MB are left on the disk; free some space before recording (at least {least} MB)",
                    mb=free >> 20,
                    least=2 * RESERVE_BYTES >> 20,
                )
            take.meta["timecode"] = timecode(datetime.now().astimezone())
            if timecode_rate is not None:
                take.meta["timecode_rate"] = timecode_rate
            take.meta["number"] = sum(1 for _ in path.parent.glob("*/take.json"))
            take.save_meta()
            return cls(take)
        except StudioError:
            shutil.rmtree(take.path)
            raise

    # --- from the engine thread

    def camera(self, hello: Hello, newest: int | None) -> JoinedEvent | None:
        """Add a camera, before its frames. Return its event for the log, None if the log has it.

        Its frames up to `newest`, of this start of its client, do not belong to the take.
        """
        key, first = (hello.name, hello.boot_id), 0 if newest is None else newest + 1
        if not self.owed.join(key, first):
            return None
        self._hellos[key] = hello
        self._queue.put(("camera", hello))
        return JoinedEvent(*key, first)

    def frame(
        self, hello: Hello, frame: CameraFrame, data: bytes, arrival_ns: int, *, late: bool = False
    ) -> bool:
        """Add a camera's frame: `data` is the message as received, `arrival_ns` on the server's clock.

        Returns False if the take has that frame already.
        """
        key = (hello.name, hello.boot_id)
        if not self._seen.setdefault(key, Ranges()).add(frame.sequence):
            self.duplicates += 1
            return False
        self.frames += 1
        self.late += late
        self.owed.came(key, frame.sequence)
        self._hellos.setdefault(key, hello)
        self._queue.put(("late" if late else "frame", hello, frame, data, arrival_ns))
        return True

    def begun(self, key: Key, sequence: int) -> bool:
        """Whether the take has an earlier frame of this start of a client."""
        first = self._seen[key].first if key in self._seen else None
        return first is not None and first < sequence

    def depth(self, hello: Hello, image: DepthImage, data: bytes, arrival_ns: int) -> None:
        """Add a camera's depth image, from any thread: `data` is the message as received.

        Left out before `camera`, and while the disk is far behind.
        """
        if (hello.name, hello.boot_id) in self._hellos and self._queue.qsize() < MAX_WAITING:
            self._queue.put(("depth", hello, image, data, arrival_ns))

    def has(self, key: Key, sequence: int) -> bool:
        """Whether the take has this frame already."""
        return key in self._seen and sequence in self._seen[key]

    def event(self, time_ns: int, event: LiveEvent) -> None:
        """Add an event of the live log at a time on the server's clock [ns]."""
        self._queue.put(("event", time_ns, event))

    def tick(self, time_ns: int, event: LiveEvent, result: StepResult | None) -> None:
        """Add an output frame: its event and its pose, written together."""
        self._queue.put(("tick", time_ns, event, self.ticks, result))
        self.ticks += 1

    def missing(self) -> dict[str, int]:
        """Number of missing frames by camera: between those in the take, or kept by a client."""
        return self.owed.missing(self._seen)

    # --- from any thread

    def when_written(self, then: Callable[[], None]) -> None:
        """Call `then`, on the recorder's thread, once all earlier data is on the disk."""
        self._queue.put(("barrier", then))

    def save_cameras(self) -> None:
        """Write the joined cameras into `take.json`; waits for the disk."""
        for hello in list(self._hellos.values()):
            self.take.add_camera(hello)
        self.take.save_meta()

    def close(self) -> None:
        """Write the rest, end the file, and store in `take.json` how the recording ended."""
        self._queue.put(("close",))
        self._thread.join()
        for camera, reason, count in self.owed.refusals():
            _log.warning("%d frames of %s were not taken into %s: %s", count, camera, self.take.path, reason)
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
                if item is not None and item[0] == "barrier":
                    self._reach(item[1])
                elif item is not None and not self.problem:
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

    def _reach(self, then: Callable[[], None]) -> None:
        """Request a sync of all earlier data."""
        try:
            if not self.problem:
                self._write_out()
                self._wait_for_disk()
        finally:
            then()

    def _fail(self, error: Exception) -> None:
        if self.problem:
            return
        reason = system_says(error) if isinstance(error, OSError) else error
        self.problem = say(
            "recording.unwritable",
            "the take cannot be written on ({reason}); free some space, then record again",
            reason=reason,
        )
        _log.error("%s: %s", self.take.path, self.problem)

    def _look_at_disk(self) -> None:
        free = shutil.disk_usage(self.take.path).free
        if free < RESERVE_BYTES:
            self.problem = say(
                "recording.disk_full",
                "the disk is nearly full ({mb} MB left): the recording was ended and is kept; free some "
                "space, then record again",
                mb=free >> 20,
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
        """Write poses before the log, so that the log has no tick without its pose."""
        self._poses.write_out()
        self._writer.write_out()
        with self._lock:
            self._written += self._waiting
        self._waiting = []

    def _sync(self) -> None:
        """Body of the thread that syncs the disk."""
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
        self.owed.synced(written)
        if written:
            self.on_synced({key for key, _ in written})

    def _write(self, item: tuple[Any, ...]) -> None:
        kind, *values = item
        if kind in ("frame", "depth"):
            self._write_to(values[0])
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
            self._write_to(*values)

    def _write_to(self, hello: Hello) -> None:
        """Write frames of a camera to the channel of this start of its client from now on."""
        if self._writing.get(hello.name) != hello.boot_id:
            self._writer.add_camera(hello)
            self._writing[hello.name] = hello.boot_id

    @property
    def bytes_written(self) -> int:
        raw = self.take.raw_path
        return self._poses.bytes_written() + (raw.stat().st_size if raw.exists() else 0)
