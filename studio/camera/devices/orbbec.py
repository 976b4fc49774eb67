"""Orbbec depth cameras (Femto Bolt, Gemini), with pyorbbecsdk2."""

from collections.abc import AsyncIterator
from dataclasses import dataclass
from typing import Any, Self

import numpy as np

from studio.camera.devices.common import library, polled
from studio.camera.devices.plugged import camera_name, seen_without_library
from studio.camera.sources.config import DeviceConfig, FoundDevice
from studio.camera.sources.depth_source import DepthShot, DepthSource, DeviceLostError
from studio.camera.sources.pacing import WallClock
from studio.engine.base.errors import NotAvailableError, StudioError
from studio.engine.model.cameras.depth import DepthCamera

_WAIT_MS = 500
_KIND, _INSTALL = "orbbec", "install the extra: uv sync --extra orbbec"


@dataclass(frozen=True)
class OrbbecConfig(DeviceConfig):
    """An Orbbec depth camera, `orbbec[:<serial>]`.

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
            sdk = library("pyorbbecsdk", kind=_KIND, install=_INSTALL)
        except NotAvailableError as error:
            return seen_without_library(_KIND, error)
        devices, found = sdk.Context().query_devices(), []
        for k in range(devices.get_count()):
            serial = devices.get_device_serial_number_by_index(k)
            name = devices.get_device_name_by_index(k) or "Orbbec"
            found.append(FoundDevice(f"{_KIND}:{serial}", name, camera_name(_KIND, serial), serial))
        return found

    def open(self) -> "OrbbecSource":
        sdk = library("pyorbbecsdk", kind=_KIND, install=_INSTALL)
        devices = sdk.Context().query_devices()
        serials = [devices.get_device_serial_number_by_index(k) for k in range(devices.get_count())]
        if not serials or (self.serial and self.serial not in serials):
            wanted = f"no Orbbec camera {self.serial}".rstrip()
            raise DeviceLostError(
                "device.none_of",
                "{wanted} is plugged in; there are: {others}",
                wanted=wanted,
                others=", ".join(serials) or "none",
            )
        return OrbbecSource(
            sdk, devices.get_device_by_index(serials.index(self.serial) if self.serial else 0)
        )


class OrbbecSource(DepthSource):
    """The depth stream of one device, in its default profile.

    Args:
        sdk: the module pyorbbecsdk.
        device: one of its devices.

    Raises:
        StudioError: it gives no depth, or not as 16-bit numbers.
    """

    def __init__(self, sdk: Any, device: Any) -> None:
        self._sdk = sdk
        info = device.get_device_info()
        self.name, self.device, self.serial = "orbbec", info.get_name(), info.get_serial_number()
        self._pipeline = sdk.Pipeline(device)
        profiles = self._pipeline.get_stream_profile_list(sdk.OBSensorType.DEPTH_SENSOR)
        self._profile = profiles.get_default_video_stream_profile()
        if self._profile.get_format() not in (sdk.OBFormat.Y16, sdk.OBFormat.Z16):
            raise StudioError(
                "device.depth_format",
                "{device} gives depth as {format}; Y16 is needed",
                device=self.device,
                format=self._profile.get_format(),
            )
        self.camera = _camera(self._profile)
        self.frames_per_second = float(self._profile.get_fps())
        self._wall = WallClock()

    def clock_ns(self) -> int:
        return self._wall.now_ns()

    async def frames(self) -> AsyncIterator[DepthShot]:
        config = self._sdk.Config()
        config.enable_stream(self._profile)
        self._pipeline.start(config)

        def wait() -> DepthShot | None:
            frames = self._pipeline.wait_for_frames(_WAIT_MS)
            depth = None if frames is None else frames.get_depth_frame()
            if depth is None:
                return None
            values = np.frombuffer(depth.get_data(), dtype="<u2").reshape(
                self.camera.height, self.camera.width
            )
            step_mm = depth.get_depth_scale()
            scaled = values.copy() if step_mm == 1.0 else np.clip(np.rint(values * step_mm), 0, 65535)
            return depth.get_timestamp_us() * 1000, scaled.astype(np.uint16)

        async for shot in polled(wait, self._pipeline.stop):
            yield shot


def _camera(profile: Any) -> DepthCamera:
    lens, bent = profile.get_intrinsic(), profile.get_distortion()
    coefficients = (bent.k1, bent.k2, bent.p1, bent.p2, bent.k3, bent.k4, bent.k5, bent.k6)
    return DepthCamera(
        lens.fx, lens.fy, lens.cx, lens.cy, lens.width, lens.height, coefficients if any(coefficients) else ()
    )
