"""Writing a take while it is recorded, on a thread of its own: nothing is dropped, the engine never waits."""

import logging
import queue
import shutil
import threading
import time
from pathlib import Path
from typing import Any

from studio.engine.errors import StudioError
from studio.engine.frames import CameraFrame
from studio.take.raw import RawWriter
from studio.take.take import Take
from studio.wire import Hello

_log = logging.getLogger(__name__)

FLUSH_S = 0.25
"""A crash loses at most this much of a recording."""


class Recorder:
    """Writes frames and events to a take's `raw.mcap` in the order in which they are given.

    Attributes:
        take: the take that is written.
        frames: camera frames given so far.
        problem: why writing has stopped, for a person; "" while all is well.
    """

    def __init__(self, path: Path, *, session: str, name: str) -> None:
        """Make the take and its raw file.

        Raises:
            StudioError: the place is taken or cannot be written; nothing is left behind.
        """
        self.take = Take.create(path, session=session, name=name, source="live")
        try:
            self._writer = RawWriter(self.take.raw_path)
        except StudioError:
            shutil.rmtree(self.take.path)
            raise
        self.frames = 0
        self.problem = ""
        self._hellos: list[Hello] = []
        self._queue: queue.SimpleQueue[tuple[Any, ...]] = queue.SimpleQueue()
        self._thread = threading.Thread(target=self._run, name="recorder", daemon=True)
        self._thread.start()

    def camera(self, hello: Hello) -> None:
        """A camera joins; must come before its frames."""
        self._hellos.append(hello)
        self._queue.put(("camera", hello))

    def frame(self, frame: CameraFrame, data: bytes, arrival_ns: int) -> None:
        """A camera's frame: `data` is the message as it came, `arrival_ns` on the server's clock."""
        self.frames += 1
        self._queue.put(("frame", frame.camera, data, arrival_ns, frame.device_time_ns, frame.sequence))

    def event(self, time_ns: int, event: dict[str, Any]) -> None:
        """An event of the live log at a time on the server's clock [ns]."""
        self._queue.put(("event", time_ns, event))

    def save_cameras(self) -> None:
        """Write the cameras that have joined into `take.json`; waits for the disk."""
        for hello in list(self._hellos):
            self.take.add_camera(hello)
        self.take.save_meta()

    def close(self) -> None:
        """Write what is left, end the file, and note in `take.json` how the recording ended."""
        self._queue.put(("close",))
        self._thread.join()
        self.take.meta["recording"] = "done"
        self.save_cameras()

    def _run(self) -> None:
        flushed = time.monotonic()
        while True:
            try:
                item = self._queue.get(timeout=FLUSH_S)
            except queue.Empty:
                item = None
            try:
                if item is not None and item[0] == "close":
                    self._writer.close()
                    return
                if item is not None and not self.problem:
                    self._write(item)
                if not self.problem and time.monotonic() - flushed >= FLUSH_S:
                    self._writer.flush()
                    flushed = time.monotonic()
            except (OSError, ValueError) as error:  # a full disk; ValueError: the file was closed by that
                reason = getattr(error, "strerror", None) or str(error)
                self.problem = (
                    f"the take cannot be written on ({reason}); stop, free some space, record again"
                )
                _log.error("%s: %s", self.take.path, self.problem)
                if item is not None and item[0] == "close":
                    return

    def _write(self, item: tuple[Any, ...]) -> None:
        kind, *values = item
        if kind == "frame":
            camera, data, arrival_ns, device_time_ns, sequence = values
            self._writer.frame(
                camera, data, arrival_ns=arrival_ns, device_time_ns=device_time_ns, sequence=sequence
            )
        elif kind == "event":
            self._writer.event(*values)
        else:
            self._writer.add_camera(*values)
