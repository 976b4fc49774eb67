"""A source that reads a camera's images; in real time it reads the newest and skips those that come meanwhile."""

import asyncio
import time
from abc import abstractmethod
from collections import deque
from collections.abc import AsyncIterator, Callable
from typing import Generic, TypeVar

from studio.camera.sources.source import Camera, Source, SourceFrame

_Item = TypeVar("_Item")
_Image = TypeVar("_Image")
_RATE_FRAMES = 60


class ReadingSource(Source, Generic[_Image]):
    """A source whose skeletons are read from a camera's images, in another thread.

    Args:
        camera: whose name, clock and rate the source has.

    Attributes:
        passed_over: number of images that were skipped.
    """

    def __init__(self, camera: Camera) -> None:
        self._camera = camera
        self.name, self.device, self.serial = camera.name, camera.device, camera.serial
        self.frames_per_second, self.realtime = camera.frames_per_second, camera.realtime
        self._read_ns = 0
        self._reading_since_ns: int | None = None
        self._done_ns: deque[int] = deque(maxlen=_RATE_FRAMES)
        self.passed_over = 0

    @property
    def tracked_ns(self) -> int:
        """Total time in which images were read, including the present one [ns]."""
        since_ns = self._reading_since_ns
        return self._read_ns + (0 if since_ns is None else time.monotonic_ns() - since_ns)

    @property
    def measured_rate(self) -> float:
        """Frame rate of the last frames, by their stamps; 0 before the second."""
        if len(self._done_ns) < 2 or self._done_ns[-1] <= self._done_ns[0]:
            return 0.0
        return (len(self._done_ns) - 1) * 1e9 / (self._done_ns[-1] - self._done_ns[0])

    @property
    def settled(self) -> bool:
        """Whether `measured_rate` covers enough frames to be judged."""
        return len(self._done_ns) == _RATE_FRAMES

    def clock_ns(self) -> int:
        return self._camera.clock_ns()

    async def read_all(self, images: AsyncIterator[tuple[int, _Image]]) -> AsyncIterator[SourceFrame]:
        """Yield what `read` makes of images, each with its capture time [ns]."""
        async for time_ns, image in newest_of(images, self._passed) if self.realtime else images:
            self._reading_since_ns = time.monotonic_ns()
            frame = await asyncio.to_thread(self.read, time_ns, image)
            self._read_ns, self._reading_since_ns = self.tracked_ns, None
            self._done_ns.append(time_ns)
            yield frame

    @abstractmethod
    def read(self, time_ns: int, image: _Image) -> SourceFrame:
        """Return the skeleton in an image that was captured at `time_ns`; it runs in another thread."""

    def _passed(self, count: int) -> None:
        self.passed_over += count


async def newest_of(items: AsyncIterator[_Item], passed_over: Callable[[int], None]) -> AsyncIterator[_Item]:
    """Yield the newest item on demand; those in between are skipped.

    Args:
        items: read as they come.
        passed_over: called with the number of items that were skipped, after each that came.
    """
    slot: list[_Item] = []
    came = asyncio.Event()

    async def read() -> None:
        try:
            async for item in items:
                passed_over(len(slot))
                slot[:] = [item]
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
