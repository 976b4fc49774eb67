"""Cameras with OpenNI 2 (Kinect v1, Xtion, Astra), with primesense and the system's libopenni2."""

import math
from collections.abc import AsyncIterator
from dataclasses import dataclass
from typing import Any, Self

import numpy as np

from studio.camera.devices.common import checked_number, device_number, library, polled
from studio.camera.devices.plugged import camera_name, seen_without_library
from studio.camera.sources.config import DeviceConfig, FoundDevice
from studio.camera.sources.depth_source import DepthShot, DepthSource, DeviceLostError
from studio.camera.sources.pacing import WallClock
from studio.engine.base.errors import NotAvailableError
from studio.engine.base.sentences import say
from studio.engine.model.cameras.depth import DepthCamera

_KIND = "openni"
_WAIT_S = 0.5
_INSTALL = "install the extra: uv sync --extra openni"
_SYSTEM = "install the system's OpenNI 2 (Debian: libopenni2-0; set OPENNI2_REDIST to its folder)"


@dataclass(frozen=True)
class OpenNIConfig(DeviceConfig):
    """A camera with OpenNI 2, `openni[:<number>]`.

    Attributes:
        number: of the device, from 0.

    Raises:
        SettingsError: a number that no device has.
    """

    number: int = 0

    def __post_init__(self) -> None:
        checked_number(self.number, _KIND)

    @classmethod
    def parse(cls, text: str) -> Self:
        return cls(device_number(text, _KIND))

    @classmethod
    def find(cls) -> list[FoundDevice]:
        try:
            _, uris = _plugged()
        except NotAvailableError as error:
            return seen_without_library(_KIND, error)
        return [
            FoundDevice(
                f"{_KIND}:{k}",
                say("device.openni", "OpenNI camera {number}", number=k + 1),
                camera_name(_KIND, str(k)),
            )
            for k in range(len(uris))
        ]

    def open(self) -> "OpenNISource":
        openni2, uris = _plugged()
        if self.number >= len(uris):
            raise DeviceLostError(
                "device.no_openni",
                "no OpenNI camera number {number} is plugged in; there are {n}",
                number=self.number,
                n=len(uris),
            )
        return OpenNISource(openni2, openni2.Device(uris[self.number]))


def _plugged() -> tuple[Any, list[Any]]:
    """Return the library, started, and the addresses of the devices that are plugged in.

    Raises:
        NotAvailableError: it is not installed, or does not start.
    """
    openni2 = library("primesense.openni2", kind=_KIND, install=_INSTALL)
    try:
        if not openni2.is_initialized():
            openni2.initialize()
        return openni2, list(openni2.Device.enumerate_uris())
    except Exception as error:  # primesense raises any error of its C library or loader
        raise NotAvailableError(
            "device.openni_not_started",
            "source openni: OpenNI 2 cannot be started ({error}); {install}",
            error=error,
            install=_SYSTEM,
        ) from error


class OpenNISource(DepthSource):
    """The depth stream of one device; its lens is known by its field of view alone, without distortion.

    Args:
        openni2: the module primesense.openni2.
        device: one of its devices.
    """

    def __init__(self, openni2: Any, device: Any) -> None:
        self._openni2 = openni2
        self.name = "openni"
        about = device.get_device_info()
        self.device = _text(about.name) or "OpenNI camera"
        self._stream = device.create_depth_stream()
        self._stream.set_mirroring_enabled(False)
        mode = self._stream.get_video_mode()
        width, height = mode.resolutionX, mode.resolutionY
        self.camera = DepthCamera(
            0.5 * width / math.tan(0.5 * self._stream.get_horizontal_fov()),
            0.5 * height / math.tan(0.5 * self._stream.get_vertical_fov()),
            0.5 * (width - 1),
            0.5 * (height - 1),
            width,
            height,
        )
        tenths = mode.pixelFormat == openni2.PIXEL_FORMAT_DEPTH_100_UM
        self._step_mm = 0.1 if tenths else 1.0
        self.frames_per_second = float(mode.fps)
        self._wall = WallClock()

    def clock_ns(self) -> int:
        return self._wall.now_ns()

    async def frames(self) -> AsyncIterator[DepthShot]:
        self._stream.start()

        def wait() -> DepthShot | None:
            if self._openni2.wait_for_any_stream([self._stream], _WAIT_S) is None:
                return None
            frame = self._stream.read_frame()
            values = np.frombuffer(frame.get_buffer_as_uint16(), dtype=np.uint16)
            depth = np.rint(values.reshape(frame.height, frame.width) * self._step_mm)
            return frame.timestamp * 1000, depth.astype(np.uint16)

        async for shot in polled(wait, self._stream.stop, (self._openni2.OpenNIError, OSError)):
            yield shot


def _text(value: Any) -> str:
    return value.decode(errors="replace") if isinstance(value, bytes) else str(value)
