"""A depth camera as a source of skeletons: the engine's observer runs in a separate process."""

import asyncio
import logging
import multiprocessing
import signal
import traceback
from collections.abc import AsyncIterator, Callable
from dataclasses import replace
from multiprocessing.connection import Connection
from typing import Any

import numpy as np
from numpy.typing import NDArray

from studio import wire
from studio.camera.sources.depth_source import DepthSource
from studio.camera.sources.reading import ReadingSource
from studio.camera.sources.source import SourceFrame
from studio.engine.base.errors import StudioError
from studio.engine.base.sentences import say
from studio.engine.model.cameras.depth import DepthCamera
from studio.engine.model.cameras.observation import Observation
from studio.take.raw.records import intrinsics_of
from studio.worker.parent import end_with_parent

_ENDED = say("tracker.ended", "the tracker's process has ended; start the camera again")

log = logging.getLogger(__name__)


class TrackedSource(ReadingSource[NDArray[np.uint16]]):
    """A source of skeletons, hand states and head orientations made from depth.

    Args:
        depth: the camera.
        keep_depth: see below.

    Attributes:
        keep_depth: the frames include their image, to be recorded.
        status: the observer's status for the newest image.
        latest: the newest image and its observation, for a preview; None at the beginning.
    """

    joint_set = "canonical"

    def __init__(self, depth: DepthSource, *, keep_depth: bool = False) -> None:
        super().__init__(depth)
        self.depth, self.intrinsics = depth, intrinsics_of(depth.camera)
        self.status = "starting"
        self.latest: tuple[NDArray[np.uint16], Observation] | None = None
        self.keep_depth = keep_depth
        self._process: ObserverProcess | None = None

    @property
    def problem(self) -> str:
        return self.depth.problem or ("" if self.latest is None else self.latest[1].problem)

    @property
    def newest_depth(self) -> tuple[int, NDArray[np.uint16]] | None:
        return None if self.latest is None else (self.latest[1].time_ns, self.latest[0])

    async def frames(self) -> AsyncIterator[SourceFrame]:
        """Yield a frame per image.

        Raises:
            StudioError: the observer ended, or the camera failed for good.
        """
        with ObserverProcess(self.name, self.depth.camera) as self._process:
            await asyncio.to_thread(self._process.wait_ready)
            async for frame in self.read_all(self.depth.frames()):
                yield frame

    def read(self, time_ns: int, image: NDArray[np.uint16]) -> SourceFrame:
        assert self._process is not None
        seen = self._process.observe(time_ns, image)
        self.status, self.latest = seen.status, (image, seen)
        return replace(
            _skeleton(seen),
            depth_mm=image if self.keep_depth else None,
            others=tuple(_skeleton(other) for other in seen.others),
        )


def _skeleton(seen: Observation) -> SourceFrame:
    return SourceFrame(
        seen.time_ns,
        seen.positions,
        seen.confidence,
        tuple(wire.HandState(h.side, h.method, h.open_probability) for h in seen.hands),
        seen.head_wxyz,
        body=seen.body,
    )


class ObserverProcess:
    """An `Observer` in a separate process; used by one thread at a time.

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
        """Return the observation of an image.

        Raises:
            StudioError: the observer failed.
        """
        try:
            self._here.send((time_ns, depth_mm))
        except OSError as error:
            raise StudioError(_ENDED) from error
        return self._receive()

    def _receive(self) -> Observation:
        try:
            kind, value = self._here.recv()
        except (EOFError, OSError) as error:
            raise StudioError(_ENDED) from error
        if kind == "crash":
            log.error("the tracker failed:\n%s", value)
            raise StudioError(
                "tracker.failed", "the tracker failed: {error}", error=value.strip().splitlines()[-1]
            )
        return value


def _observe(
    connection: Connection, make: Callable[[str, DepthCamera], Any] | None, name: str, camera: DepthCamera
) -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for the client, which ends its observer
    parent = multiprocessing.parent_process()
    if parent is not None and parent.pid is not None:
        end_with_parent(parent.pid)  # also while it loads, which takes seconds
    try:
        observer = (make or _observer)(name, camera)
        connection.send(("ready", None))
        while True:
            connection.send(("done", observer.observe(*connection.recv())))
    except (EOFError, BrokenPipeError, ConnectionResetError):
        return  # the client has ended
    except Exception:  # boundary of the process: the client logs it
        connection.send(("crash", traceback.format_exc()))


def _observer(name: str, camera: DepthCamera) -> Any:
    from studio.engine.seeing.observer import Observer  # with its tracker, in this process only

    return Observer(name, camera)
