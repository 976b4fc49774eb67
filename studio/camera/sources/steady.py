"""Reconnection of a device of depth or skeletons: if lost or silent, it is opened again, after growing pauses."""

import asyncio
import logging
from abc import abstractmethod
from collections.abc import AsyncGenerator, AsyncIterator, Callable
from dataclasses import dataclass, replace
from typing import Any, Generic, TypeVar

from studio.camera.sources.depth_source import DepthShot, DepthSource, DeviceLostError
from studio.camera.sources.pacing import WallClock
from studio.camera.sources.source import Camera, Source, SourceFrame
from studio.engine.base.errors import StudioError

_LONGEST_PAUSE_S = 30.0

_Device = TypeVar("_Device", Source, DepthSource)

log = logging.getLogger(__name__)


@dataclass(frozen=True)
class Patience:
    """Times after which a device counts as lost and is opened again.

    Attributes:
        silent_s: a device without an image for this long counts as lost.
        first_pause_s: before the first try to open it again; doubles up to half a minute.
    """

    silent_s: float = 5.0
    first_pause_s: float = 1.0


def steady(
    open_device: Callable[[], Source | DepthSource], patience: Patience | None = None
) -> "SteadySource | SteadyDepthSource":
    """Return a device that reconnects: a depth camera if the device is one, else a source of skeletons.

    Times stay on one clock, that of this machine. A device that comes back with another serial number or other
    intrinsics is another camera and is refused.

    Args:
        open_device: opens the device; raises a StudioError while it is missing.
        patience: the usual one where None.

    Raises:
        StudioError: the device cannot be opened now.
    """
    device = open_device()
    patience = patience or Patience()
    if isinstance(device, DepthSource):
        return SteadyDepthSource(device, open_device, patience)
    return SteadySource(device, open_device, patience)


class _Steady(Camera, Generic[_Device]):
    """Common base of reconnecting devices; `steady` makes them."""

    def __init__(
        self, opened: _Device, open_device: Callable[[], Source | DepthSource], patience: Patience
    ) -> None:
        self.name, self.device, self.serial = opened.name, opened.device, opened.serial
        self.frames_per_second = opened.frames_per_second
        self._opened: _Device | None = opened
        self._open, self._patience = open_device, patience
        self._problem = ""
        self._wall = WallClock()

    @property
    def problem(self) -> str:
        return self._problem or ("" if self._opened is None else self._opened.problem)

    def clock_ns(self) -> int:
        return self._wall.now_ns()

    @abstractmethod
    def _same(self, device: Source | DepthSource) -> _Device | None:
        """Return a device that came back, None if it is of another kind or has other intrinsics."""

    @abstractmethod
    def _restamped(self, item: Any, clock: "DeviceClock", arrival_ns: int) -> Any:
        """Return an image or a skeleton with its time on this machine's clock."""

    async def _items(self) -> AsyncIterator[Any]:
        pause_s = self._patience.first_pause_s
        while True:
            if self._opened is not None:
                clock = DeviceClock()
                try:
                    async for item in _until_silent(self._opened.frames(), self._patience.silent_s):
                        if self._problem:
                            log.warning("camera %s: %s is back", self.name, self.device)
                        self._problem, pause_s = "", self._patience.first_pause_s
                        yield self._restamped(item, clock, self._wall.now_ns())
                    reason = "it gives no more images"
                except (StudioError, OSError, RuntimeError) as error:
                    reason = str(error) or type(error).__name__
                self._opened = None
                self._say(reason, pause_s)
            await asyncio.sleep(pause_s)
            pause_s = min(2 * pause_s, _LONGEST_PAUSE_S)
            self._opened = await self._try_again(pause_s)

    async def _try_again(self, pause_s: float) -> _Device | None:
        try:
            device = await asyncio.to_thread(self._open)
        except (StudioError, OSError, RuntimeError) as error:
            self._say(str(error) or type(error).__name__, pause_s)
            return None
        if device.serial != self.serial:
            self._say("another device is plugged in instead: start the client again", pause_s)
            return None
        same = self._same(device)
        if same is None:
            self._say("it came back with other intrinsics: start the client again", pause_s)
        return same

    def _say(self, reason: str, pause_s: float) -> None:
        problem = f"{self.device} is lost: {reason}"
        if problem != self._problem:
            log.warning("camera %s: %s; trying again in %.0f s", self.name, problem, pause_s)
        self._problem = problem


class SteadySource(_Steady[Source], Source):
    """A device of skeletons that reconnects."""

    def __init__(
        self, opened: Source, open_device: Callable[[], Source | DepthSource], patience: Patience
    ) -> None:
        super().__init__(opened, open_device, patience)
        self.joint_set, self.intrinsics = opened.joint_set, opened.intrinsics

    @property
    def tracked_ns(self) -> int:
        return 0 if self._opened is None else self._opened.tracked_ns

    def frames(self) -> AsyncIterator[SourceFrame]:
        return self._items()

    def _same(self, device: Source | DepthSource) -> Source | None:
        return device if isinstance(device, Source) and device.intrinsics == self.intrinsics else None

    def _restamped(self, item: SourceFrame, clock: "DeviceClock", arrival_ns: int) -> SourceFrame:
        return replace(item, device_time_ns=clock.host_ns(item.device_time_ns, arrival_ns))


class SteadyDepthSource(_Steady[DepthSource], DepthSource):
    """A depth camera that reconnects."""

    def __init__(
        self, opened: DepthSource, open_device: Callable[[], Source | DepthSource], patience: Patience
    ) -> None:
        super().__init__(opened, open_device, patience)
        self.camera = opened.camera

    def frames(self) -> AsyncIterator[DepthShot]:
        return self._items()

    def _same(self, device: Source | DepthSource) -> DepthSource | None:
        return device if isinstance(device, DepthSource) and device.camera == self.camera else None

    def _restamped(self, item: DepthShot, clock: "DeviceClock", arrival_ns: int) -> DepthShot:
        return clock.host_ns(item[0], arrival_ns), item[1]


async def _until_silent(frames: AsyncIterator[Any], silent_s: float) -> AsyncIterator[Any]:
    """Yield items until one is late.

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
                raise DeviceLostError(
                    "device.no_image", "no image for {seconds:g} s", seconds=silent_s
                ) from error
    finally:
        if isinstance(iterator, AsyncGenerator):
            await iterator.aclose()


class DeviceClock:
    """Converts a device's stamps to this machine's clock by the shortest delay between stamp and arrival.

    The shortest delay of the last `window` images follows a drift; a late image does not move the clock.
    """

    def __init__(self, window: int = 300) -> None:
        self._delays: list[int] = []
        self._window = window
        self._newest_ns = -1

    def host_ns(self, device_ns: int, arrival_ns: int) -> int:
        """Return the time of an image on this machine's clock [ns], later than that of the image before."""
        self._delays.append(arrival_ns - device_ns)
        del self._delays[: -self._window]
        self._newest_ns = max(device_ns + min(self._delays), self._newest_ns + 1)
        return self._newest_ns
