"""What a camera that gives depth images is, and a device that comes back when it was unplugged."""

import asyncio
import logging
from collections.abc import AsyncIterator, Callable
from dataclasses import replace
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from studio.camera.pacing import WallClock
from studio.engine.depth import DepthCamera
from studio.engine.errors import StudioError

DepthShot = tuple[int, NDArray[np.uint16]]
"""Capture time on the source's clock [ns], and depth [mm], shape (height, width); 0 = no reading."""

_FIRST_PAUSE_S, _LONGEST_PAUSE_S = 1.0, 30.0
_SILENT_S = 5.0

log = logging.getLogger(__name__)


class DeviceLostError(StudioError):
    """A device that was there gives no more images: unplugged, reset, or its library failed."""


class DepthSource(Protocol):
    """A depth camera: what it is, its intrinsics, its clock, and its images.

    Attributes:
        name: the camera's name where the user gives none.
        device: what it is, for people.
        camera: intrinsics of every image.
        frames_per_second: nominal.
        realtime: images come at their own pace and an old one may be dropped; False = wait for the reader.
    """

    name: str
    device: str
    camera: DepthCamera
    frames_per_second: float
    realtime: bool

    def clock_ns(self) -> int:
        """Return the clock that stamps the images, now [ns]."""

    def frames(self) -> AsyncIterator[DepthShot]:
        """Yield images as they come; ends where the source does.

        Raises:
            DeviceLostError: the device is gone; opening the source again may find it.
        """


class SteadySource:
    """A device, of depth or of skeletons, that is opened again, after growing pauses, when it is lost or silent.

    Times stay on one clock, that of this machine. A device that comes back with other intrinsics is another camera
    and is not taken.

    Args:
        open_device: opens the source; raises a StudioError while the device is not there.
        silent_s: a device that gives no image for so long counts as lost.
        first_pause_s: before the first try to open it again; doubles up to half a minute.

    Attributes:
        problem: what is wrong at the moment, for a person; "" = images come.
        camera: intrinsics of a depth source, else None. joint_set: of a source of skeletons, else "".

    Raises:
        StudioError: the source cannot be opened now.
    """

    def __init__(
        self,
        open_device: Callable[[], Any],
        *,
        silent_s: float = _SILENT_S,
        first_pause_s: float = _FIRST_PAUSE_S,
    ) -> None:
        self._open = open_device
        self._silent_s, self._first_pause_s = silent_s, first_pause_s
        self._source: Any = open_device()
        self.name, self.device = self._source.name, self._source.device
        self.serial: str = getattr(self._source, "serial", "")
        self.frames_per_second = self._source.frames_per_second
        self.camera: DepthCamera | None = getattr(self._source, "camera", None)
        self.joint_set: str = getattr(self._source, "joint_set", "")
        self.realtime = True
        self.problem = ""
        self._wall = WallClock()

    def clock_ns(self) -> int:
        return self._wall.now_ns()

    async def frames(self) -> AsyncIterator[Any]:
        pause_s = self._first_pause_s
        while True:
            if self._source is not None:
                clock = DeviceClock()
                try:
                    async for item in _until_silent(self._source.frames(), self._silent_s):
                        if self.problem:
                            log.warning("camera %s: %s is back", self.name, self.device)
                        self.problem, pause_s = "", self._first_pause_s
                        yield _restamped(item, clock, self._wall.now_ns())
                    reason = "it gives no more images"
                except (StudioError, OSError, RuntimeError) as error:
                    reason = str(error) or type(error).__name__
                self._source = None
                self._say(reason, pause_s)
            await asyncio.sleep(pause_s)
            pause_s = min(2 * pause_s, _LONGEST_PAUSE_S)
            self._source = await self._try_again(pause_s)

    async def _try_again(self, pause_s: float) -> Any:
        try:
            source = await asyncio.to_thread(self._open)
        except (StudioError, OSError, RuntimeError) as error:
            self._say(str(error) or type(error).__name__, pause_s)
            return None
        if getattr(source, "serial", "") != self.serial:
            self._say("another device is plugged in instead: start the client again", pause_s)
            return None
        if getattr(source, "camera", None) != self.camera:
            self._say("it came back with other intrinsics: start the client again", pause_s)
            return None
        return source

    def _say(self, reason: str, pause_s: float) -> None:
        problem = f"{self.device} is lost: {reason}"
        if problem != self.problem:
            log.warning("camera %s: %s; trying again in %.0f s", self.name, problem, pause_s)
        self.problem = problem


def _restamped(item: Any, clock: "DeviceClock", arrival_ns: int) -> Any:
    """Return an image or a skeleton with its time on this machine's clock."""
    if isinstance(item, tuple):
        return clock.host_ns(item[0], arrival_ns), item[1]
    return replace(item, device_time_ns=clock.host_ns(item.device_time_ns, arrival_ns))


async def _until_silent(frames: AsyncIterator[Any], silent_s: float) -> AsyncIterator[Any]:
    """Yield items until one does not come in time.

    Raises:
        DeviceLostError: none came for `silent_s`.
    """
    iterator = aiter(frames)
    try:
        while True:
            try:
                yield await asyncio.wait_for(anext(iterator), silent_s)
            except StopAsyncIteration:
                return
            except TimeoutError as error:
                raise DeviceLostError(f"no image for {silent_s:g} s") from error
    finally:
        close = getattr(iterator, "aclose", None)
        if close is not None:
            await close()


class DeviceClock:
    """Puts a device's stamps on this machine's clock: the shortest delay between stamp and arrival counts.

    The shortest delay of the last `window` images follows a drift; a late image does not move the clock.
    """

    def __init__(self, window: int = 300) -> None:
        self._delays: list[int] = []
        self._window = window
        self._newest_ns = -1

    def host_ns(self, device_ns: int, arrival_ns: int) -> int:
        """Return the time of an image on this machine's clock [ns]; later than the image before."""
        self._delays.append(arrival_ns - device_ns)
        del self._delays[: -self._window]
        self._newest_ns = max(device_ns + min(self._delays), self._newest_ns + 1)
        return self._newest_ns
