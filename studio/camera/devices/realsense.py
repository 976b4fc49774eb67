"""RealSense depth cameras, with pyrealsense2."""

from collections.abc import AsyncIterator
from contextlib import suppress
from dataclasses import dataclass
from typing import Any, Self

import numpy as np

from studio.camera.devices.common import device_failed, library, polled
from studio.camera.devices.plugged import camera_name, seen_without_library
from studio.camera.sources.config import DeviceConfig, FoundDevice
from studio.camera.sources.depth_source import DepthShot, DepthSource, DeviceLostError
from studio.camera.sources.pacing import WallClock
from studio.engine.base.errors import FormatError, NotAvailableError
from studio.engine.model.cameras.depth import DepthCamera

_WANTED = (848, 480, 30)
_WAIT_MS = 500
_QUEUE = 2
_KIND, _INSTALL = "realsense", "install the extra: uv sync --extra realsense"


@dataclass(frozen=True)
class RealSenseConfig(DeviceConfig):
    """A RealSense, `realsense[:<serial>]`.

    Attributes:
        serial: of the device; "" = the first one.
    """

    serial: str = ""

    @classmethod
    def parse(cls, text: str) -> Self:
        return cls(text)

    @classmethod
    def find(cls) -> list[FoundDevice]:
        try:
            rs = library("pyrealsense2", kind=_KIND, install=_INSTALL)
        except NotAvailableError as error:
            return seen_without_library(_KIND, error)
        found = []
        for device in rs.context().query_devices():
            serial, name = _info(rs, device, "serial_number"), _info(rs, device, "name") or "RealSense"
            found.append(FoundDevice(f"{_KIND}:{serial}", name, camera_name(_KIND, serial), serial))
        return found

    def open(self) -> "RealSenseSource":
        rs = library("pyrealsense2", kind=_KIND, install=_INSTALL)
        devices = list(rs.context().query_devices())
        serials = [device.get_info(rs.camera_info.serial_number) for device in devices]
        if self.serial and self.serial not in serials:
            raise DeviceLostError(
                "device.no_realsense_serial",
                "no RealSense with serial {serial} is plugged in; there are: {others}",
                serial=self.serial,
                others=", ".join(serials) or "none",
            )
        if not devices:
            raise DeviceLostError("device.no_realsense", "no RealSense is plugged in")
        return RealSenseSource(rs, devices[serials.index(self.serial) if self.serial else 0])


class RealSenseSource(DepthSource):
    """The depth stream of one device.

    Args:
        rs: the module pyrealsense2.
        device: an `rs.device`, real or software.

    Raises:
        DeviceLostError: it gives no depth.
        FormatError: an unknown lens model.
    """

    def __init__(self, rs: Any, device: Any) -> None:
        self._rs = rs
        self._device = device
        self._sensor, self._profile = _depth_profile(rs, device)
        self.name = "realsense"
        self.device = _info(rs, device, "name") or "RealSense"
        self.serial = _info(rs, device, "serial_number")
        self.camera = _camera(rs, self._profile.intrinsics)
        self.frames_per_second = float(self._profile.fps())
        self._wall = WallClock()

    def clock_ns(self) -> int:
        return self._wall.now_ns()

    async def frames(self) -> AsyncIterator[DepthShot]:
        queue = self._rs.frame_queue(_QUEUE)
        try:
            self._sensor.open(self._profile)
            self._sensor.start(queue)
        except RuntimeError as error:
            raise device_failed(error) from error

        def wait() -> DepthShot | None:
            found, frame = queue.try_wait_for_frame(_WAIT_MS)
            if not found:
                return None
            depth = frame.as_depth_frame()
            step_mm = depth.get_units() * 1e3
            values = np.asanyarray(depth.get_data())
            scaled = (
                values.copy() if abs(step_mm - 1) < 1e-6 else np.clip(np.rint(values * step_mm), 0, 65535)
            )
            return round(depth.get_timestamp() * 1e6), scaled.astype(np.uint16)

        def close() -> None:
            with suppress(RuntimeError):  # a lost device cannot be stopped
                self._sensor.stop()
                self._sensor.close()

        async for shot in polled(wait, close):
            yield shot


def _depth_profile(rs: Any, device: Any) -> tuple[Any, Any]:
    """Return the sensor with depth and its profile nearest to 848 x 480 at 30 Hz."""
    found = []
    for sensor in device.query_sensors():
        for profile in sensor.get_stream_profiles():
            if profile.stream_type() == rs.stream.depth and profile.format() == rs.format.z16:
                video = profile.as_video_stream_profile()
                offered = (video.width(), video.height(), video.fps())
                found.append((sum(abs(a - b) for a, b in zip(offered, _WANTED, strict=True)), sensor, video))
    if not found:
        raise DeviceLostError("device.no_depth", "the RealSense gives no depth")
    _, sensor, profile = min(found, key=lambda item: item[0])
    return sensor, profile


def _camera(rs: Any, intrinsics: Any) -> DepthCamera:
    coefficients = tuple(float(c) for c in intrinsics.coeffs)
    if any(coefficients) and intrinsics.model not in (rs.distortion.brown_conrady, rs.distortion.none):
        raise FormatError(
            "device.lens_model",
            "the RealSense's lens model {model} is not known to the studio",
            model=intrinsics.model,
        )
    return DepthCamera(
        intrinsics.fx,
        intrinsics.fy,
        intrinsics.ppx,
        intrinsics.ppy,
        intrinsics.width,
        intrinsics.height,
        coefficients if any(coefficients) else (),
    )


def _info(rs: Any, device: Any, name: str) -> str:
    what = getattr(rs.camera_info, name)
    return str(device.get_info(what)) if device.supports(what) else ""
