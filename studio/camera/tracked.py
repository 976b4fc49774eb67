"""A depth camera as a source of skeletons: the engine's observer runs in a process of its own.

Of a camera in real time the newest image counts: while the observer is busy, older ones are passed over and counted.
"""

import asyncio
import logging
import multiprocessing
import signal
import time
import traceback
from collections import deque
from collections.abc import AsyncIterator, Callable
from multiprocessing.connection import Connection
from typing import Any

import numpy as np
from numpy.typing import NDArray

from studio import wire
from studio.camera.depth_source import DepthShot, DepthSource
from studio.camera.sources import SourceFrame
from studio.engine.depth import DepthCamera
from studio.engine.errors import StudioError
from studio.engine.observation import Observation
from studio.take.raw_records import intrinsics_of

_RATE_FRAMES = 60

log = logging.getLogger(__name__)


class TrackedSource:
    """A source of skeletons, hand states and head orientations made from depth.

    Args:
        depth: the camera.
        keep_depth: the frames carry their image, to be recorded.

    Attributes:
        passed_over: images that came while the observer was busy.
        status: what the observer says of the newest image.
        latest: the newest image and what was found in it, for a preview; None at the beginning.
    """

    joint_set = "canonical"

    def __init__(self, depth: DepthSource, *, keep_depth: bool = False) -> None:
        self.depth = depth
        self.name, self.device = depth.name, depth.device
        self.serial = str(getattr(depth, "serial", ""))
        self.frames_per_second, self.realtime = depth.frames_per_second, depth.realtime
        self.intrinsics: wire.Intrinsics | None = intrinsics_of(depth.camera)
        self._tracked_ns = 0
        self._observing_since_ns: int | None = None
        self.passed_over = 0
        self.status = "starting"
        self.latest: tuple[NDArray[np.uint16], Observation] | None = None
        self._keep_depth = keep_depth
        self._done_ns: deque[int] = deque(maxlen=_RATE_FRAMES)

    @property
    def tracked_ns(self) -> int:
        """How long the observer has been busy in all, the image that it works on included [ns]."""
        since_ns = self._observing_since_ns
        return self._tracked_ns + (0 if since_ns is None else time.monotonic_ns() - since_ns)

    @property
    def measured_rate(self) -> float:
        """Frames per second of the last ones, by their stamps; 0 before two have come."""
        if len(self._done_ns) < 2 or self._done_ns[-1] <= self._done_ns[0]:
            return 0.0
        return (len(self._done_ns) - 1) * 1e9 / (self._done_ns[-1] - self._done_ns[0])

    @property
    def problem(self) -> str:
        """What is wrong with the camera at the moment, for a person; "" = nothing."""
        return str(getattr(self.depth, "problem", ""))

    def clock_ns(self) -> int:
        return self.depth.clock_ns()

    async def frames(self) -> AsyncIterator[SourceFrame]:
        """Yield a frame per image.

        Raises:
            StudioError: the observer broke off, or the camera failed for good.
        """
        with ObserverProcess(self.name, self.depth.camera) as process:
            await asyncio.to_thread(process.wait_ready)
            images = self._newest() if self.realtime else aiter(self.depth.frames())
            async for time_ns, depth_mm in images:
                self._observing_since_ns = time.monotonic_ns()
                seen = await asyncio.to_thread(process.observe, time_ns, depth_mm)
                self._tracked_ns, self._observing_since_ns = self.tracked_ns, None
                self.status, self.latest = seen.status, (depth_mm, seen)
                self._done_ns.append(time_ns)
                yield SourceFrame(
                    time_ns,
                    seen.positions,
                    seen.confidence,
                    tuple(wire.HandState(h.side, h.method, h.open_probability) for h in seen.hands),
                    seen.head_wxyz,
                    depth_mm if self._keep_depth else None,
                )

    async def _newest(self) -> AsyncIterator[DepthShot]:
        """Yield the newest image whenever one is asked for; those in between are passed over."""
        slot: list[DepthShot] = []
        came = asyncio.Event()

        async def read() -> None:
            try:
                async for shot in self.depth.frames():
                    self.passed_over += len(slot)
                    slot[:] = [shot]
                    came.set()
            finally:
                came.set()

        reader = asyncio.create_task(read())
        try:
            while True:
                await came.wait()
                came.clear()
                if slot:
                    yield slot.pop()
                elif reader.done():
                    reader.result()
                    return
        finally:
            reader.cancel()
            await asyncio.gather(reader, return_exceptions=True)


class ObserverProcess:
    """An `Observer` in a process of its own; used by one thread at a time.

    Args:
        name, camera: as for `Observer`.
        make: makes the observer, in the process; a function of a module's top level.
    """

    def __init__(
        self, name: str, camera: DepthCamera, make: Callable[[str, DepthCamera], Any] | None = None
    ) -> None:
        context = multiprocessing.get_context("spawn")
        self._here, there = context.Pipe()
        self._process = context.Process(target=_observe, args=(there, make, name, camera), daemon=True)
        self._process.start()
        there.close()

    def __enter__(self) -> "ObserverProcess":
        return self

    def __exit__(self, *_: object) -> None:
        self._here.close()
        self._process.join(2.0)
        if self._process.is_alive():
            self._process.terminate()
            self._process.join()

    def wait_ready(self) -> None:
        """Return when the observer is made.

        Raises:
            StudioError: it cannot be made.
        """
        self._receive()

    def observe(self, time_ns: int, depth_mm: NDArray[np.uint16]) -> Observation:
        """Return what is in an image.

        Raises:
            StudioError: the observer failed.
        """
        try:
            self._here.send((time_ns, depth_mm))
        except OSError as error:
            raise StudioError("the tracker's process has ended; start the camera again") from error
        return self._receive()

    def _receive(self) -> Observation:
        try:
            kind, value = self._here.recv()
        except (EOFError, OSError) as error:
            raise StudioError("the tracker's process has ended; start the camera again") from error
        if kind == "crash":
            log.error("the tracker failed:\n%s", value)
            raise StudioError(f"the tracker failed: {value.strip().splitlines()[-1]}")
        return value


def _observe(
    connection: Connection, make: Callable[[str, DepthCamera], Any] | None, name: str, camera: DepthCamera
) -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for the client, which ends its observer
    try:
        observer = (make or _observer)(name, camera)
        connection.send(("ready", None))
        while True:
            connection.send(("done", observer.observe(*connection.recv())))
    except (EOFError, BrokenPipeError, ConnectionResetError):
        return  # the client has gone
    except Exception:  # the boundary of the process: the client logs it
        connection.send(("crash", traceback.format_exc()))


def _observer(name: str, camera: DepthCamera) -> Any:
    from studio.engine.observer import Observer  # with its tracker, in this process only

    return Observer(name, camera)
