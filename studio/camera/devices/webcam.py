"""A webcam, read with PyAV; its pictures become landmarks on this machine."""

import sys
import threading
from collections.abc import AsyncIterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Self

import numpy as np
from numpy.typing import NDArray

from studio.camera.devices.common import checked_number, device_number, polled
from studio.camera.devices.plugged import camera_name, video_devices
from studio.camera.sources.config import DeviceConfig, FoundDevice
from studio.camera.sources.depth_source import DeviceLostError
from studio.camera.sources.pacing import WallClock
from studio.camera.sources.picture import no_image
from studio.camera.sources.picture_options import PictureConfig
from studio.camera.sources.posed import PictureSource, PosedSource
from studio.engine.base.system import VIDEO_NODE
from studio.take.video.picture import small_picture

if TYPE_CHECKING:
    import av
    from av.container import InputContainer

    from studio.camera.sources.posed import PictureShot

_KIND = "webcam"
_DARK_FRAMES = 5
"""Number of first pictures during which a webcam adjusts its exposure."""

_SILENT_S = 5.0
_WISHES = {"video_size": "1280x720", "framerate": "30"}


@dataclass(frozen=True)
class WebcamConfig(PictureConfig, DeviceConfig):
    """A webcam, `webcam[:<number>][?model=...][&mirrored][&no-hands]`.

    Attributes:
        number: of the webcam, from 0.

    Raises:
        SettingsError: a number that no device has.
    """

    number: int = 0

    def __post_init__(self) -> None:
        super().__post_init__()
        checked_number(self.number, _KIND)

    @classmethod
    def of(cls, text: str, **options: Any) -> Self:
        return cls(device_number(text, _KIND), **options)

    @classmethod
    def find(cls) -> list[FoundDevice]:
        return [
            FoundDevice(f"{_KIND}:{number}", name, camera_name(_KIND, str(number)))
            for number, name in listed()
        ]

    def picture(self) -> NDArray[np.uint8]:
        with opened(self.number) as container:
            for count, frame in enumerate(container.decode(video=0)):
                if count + 1 == _DARK_FRAMES:
                    return small_picture(frame, mirrored=self.mirrored).image
        raise no_image(f"webcam {self.number}")

    def open(self) -> PosedSource:
        pictures = WebcamPictures(self.number)
        return PosedSource(pictures, self.model, mirrored=self.mirrored, hands=self.hands)


def listed() -> list[tuple[int, str]]:
    """Return number and name of the webcams of this machine."""
    if sys.platform == "linux":
        return video_devices()
    return [(number, name) for number, (_, name) in enumerate(_by_system())]


def _by_system() -> list[tuple[str, str]]:
    """Return address and name of the webcams that macOS or Windows lists."""
    from av.device import enumerate_input_devices

    devices = enumerate_input_devices("avfoundation" if sys.platform == "darwin" else "dshow")
    return [(one.name, one.description or one.name) for one in devices if "video" in one.media_types]


def _address(number: int) -> tuple[str, str, list[dict[str, str]]]:
    """Return a webcam's address, the name of its driver, and the settings to try in turn."""
    if sys.platform == "linux":
        packed = {"input_format": "mjpeg", **_WISHES}  # most webcams give large pictures fast only as MJPEG
        return VIDEO_NODE.format(number=number), "v4l2", [packed, _WISHES, {}]
    if sys.platform == "darwin":
        return f"{number}:none", "avfoundation", [_WISHES, {"framerate": "30"}]
    names = [address for address, _ in _by_system()]
    if number >= len(names):
        raise _missing(number)
    address = names[number]
    return address if address.startswith("video=") else f"video={address}", "dshow", [_WISHES, {}]


def opened(number: int) -> "InputContainer":
    """Return a webcam, opened.

    Raises:
        DeviceLostError: there is none of this number, or it cannot be opened.
    """
    import av
    from av.error import FFmpegError

    address, driver, settings = _address(number)
    error: Exception | None = None
    for options in settings:
        try:
            container = av.open(address, "r", format=driver, options=options, timeout=_SILENT_S)
        except FileNotFoundError:
            raise _missing(number) from None
        except (FFmpegError, OSError, ValueError) as failed:
            error = failed
            continue
        if container.streams.video:
            return container
        container.close()
    raise DeviceLostError(
        "device.webcam_closed",
        "webcam {number} cannot be opened ({error}); close what else uses it, and let this user read it",
        number=number,
        error=getattr(error, "strerror", "") or str(error or "it gives no pictures"),
    )


def _missing(number: int) -> DeviceLostError:
    return DeviceLostError(
        "device.no_webcam",
        "no webcam number {number} is plugged in; plug one in, or give another number",
        number=number,
    )


class WebcamPictures(PictureSource):
    """The pictures of a webcam.

    Args:
        number: of the webcam, from 0.

    Raises:
        DeviceLostError: as for `opened`.
    """

    def __init__(self, number: int) -> None:
        self._container = opened(number)
        track = self._container.streams.video[0]
        size = f"{track.codec_context.width} x {track.codec_context.height}"
        self.name, self.device = camera_name(_KIND, str(number)), f"webcam {number}, {size}"
        self.frames_per_second = float(track.average_rate or track.guessed_rate or 30)
        self._wall = WallClock()

    def clock_ns(self) -> int:
        return self._wall.now_ns()

    async def frames(self) -> "AsyncIterator[PictureShot]":
        from av.error import FFmpegError

        decoded = self._container.decode(video=0)
        at_work = threading.Lock()  # the device is closed only after a read in progress

        def wait() -> "PictureShot":
            with at_work:
                frame: av.VideoFrame | None = next(decoded, None)
                now_ns = self._wall.now_ns()
            if frame is None:
                raise OSError("the webcam gives no more pictures")
            return now_ns if frame.pts is None else _stamp_ns(frame), frame

        def close() -> None:
            with at_work:
                self._container.close()

        async for shot in polled(wait, close, (FFmpegError, OSError, RuntimeError)):
            yield shot


def _stamp_ns(frame: "av.VideoFrame") -> int:
    return round((frame.pts or 0) * (frame.time_base or 0) * 10**9)
