"""Azure Kinect, with pykinect_azure and the sensor SDK of the system; `?bodies` uses the SDK's body tracking."""

import asyncio
from collections.abc import AsyncIterator
from dataclasses import dataclass
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from studio.camera.devices.common import checked_number, device_number, library, polled, split_argument
from studio.camera.devices.plugged import camera_name, seen_without_library
from studio.camera.sources.config import DeviceConfig, FoundDevice
from studio.camera.sources.depth_source import DepthShot, DepthSource, DeviceLostError
from studio.camera.sources.pacing import WallClock
from studio.camera.sources.source import Source, SourceFrame
from studio.engine.base.errors import NotAvailableError
from studio.engine.model.joints import JOINT_SETS
from studio.take.raw.records import depth_camera

_KIND, _MODE = "azure-kinect", "NFOV_2X2BINNED"
_INSTALL = "install the extra: uv sync --extra azure-kinect, and the Azure Kinect SDK 1.4"
_JOINTS = len(JOINT_SETS["azure-kinect"])
_CONFIDENCE = (0.0, 0.4, 0.9, 1.0)
"""For the SDK's levels none, low, medium, high."""


@dataclass(frozen=True)
class AzureKinectConfig(DeviceConfig):
    """An Azure Kinect, `azure-kinect[:<number>][?bodies]`.

    Attributes:
        number: of the device, from 0.
        bodies: give the skeletons of the SDK's body tracking instead of depth.

    Raises:
        SettingsError: a number that no device has.
    """

    number: int = 0
    bodies: bool = False

    def __post_init__(self) -> None:
        checked_number(self.number, _KIND)

    @classmethod
    def parse(cls, text: str) -> Self:
        text, flags = split_argument(text, _KIND, ("bodies",))
        return cls(device_number(text, _KIND), "bodies" in flags)

    @classmethod
    def find(cls) -> list[FoundDevice]:
        try:
            kinect = library("pykinect_azure", kind=_KIND, install=_INSTALL)
            count = _plugged(kinect)
        except NotAvailableError as error:
            return seen_without_library(_KIND, error)
        return [
            FoundDevice(f"{_KIND}:{k}", f"Azure Kinect {k + 1}", camera_name(_KIND, str(k)))
            for k in range(count)
        ]

    def open(self) -> "AzureKinectSource | AzureKinectBodies":
        kinect = library("pykinect_azure", kind=_KIND, install=_INSTALL)
        try:
            kinect.initialize_libraries(track_body=self.bodies)
            settings = kinect.default_configuration
            settings.color_resolution = kinect.K4A_COLOR_RESOLUTION_OFF
            settings.depth_mode = kinect.K4A_DEPTH_MODE_NFOV_2X2BINNED
            device = kinect.start_device(device_index=self.number, config=settings)
        except (
            Exception,
            SystemExit,
        ) as error:  # pykinect_azure raises, prints or exits, depending on its C library
            raise DeviceLostError(
                "device.azure_not_started",
                "Azure Kinect {number} cannot be started ({error}); is it plugged in?",
                number=self.number,
                error=error,
            ) from error
        if self.bodies:
            return AzureKinectBodies(device, kinect.start_body_tracker())
        return AzureKinectSource(device)


def _plugged(kinect: Any) -> int:
    """Return how many devices are plugged in.

    Raises:
        NotAvailableError: the system's SDK does not answer.
    """
    try:
        kinect.initialize_libraries()
        return int(kinect.k4a_device_get_installed_count())
    except (
        Exception,
        SystemExit,
    ) as error:  # pykinect_azure raises any error of its C library or loader, or exits
        raise NotAvailableError(
            "device.no_sdk",
            "source {kind}: its SDK does not answer ({error}); {install}",
            kind=_KIND,
            error=str(error) or type(error).__name__,
            install=_INSTALL,
        ) from error


class AzureKinectSource(DepthSource):
    """The depth stream, narrow field of view, binned 2 x 2: 320 x 288."""

    name, device = "azure-kinect", "Azure Kinect"

    def __init__(self, device: Any) -> None:
        from studio.take.importers.k4a import intrinsics  # slow to load

        self._device = device
        self.camera = depth_camera(intrinsics(device.get_raw_calibration(), _MODE))
        self._wall = WallClock()

    def clock_ns(self) -> int:
        return self._wall.now_ns()

    async def frames(self) -> AsyncIterator[DepthShot]:
        def wait() -> DepthShot | None:
            found, depth = self._device.update().get_depth_image()
            return (self._wall.now_ns(), np.array(depth, dtype=np.uint16)) if found else None

        async for shot in polled(wait, self._device.close):
            yield shot


class AzureKinectBodies(Source):
    """The first body of the SDK's tracker, in the depth camera's frame."""

    name, device, joint_set = "azure-kinect", "Azure Kinect, SDK body tracking", "azure-kinect"

    def __init__(self, device: Any, tracker: Any) -> None:
        self._device, self._tracker = device, tracker
        self._wall = WallClock()

    def clock_ns(self) -> int:
        return self._wall.now_ns()

    async def frames(self) -> AsyncIterator[SourceFrame]:
        try:
            while True:
                await asyncio.to_thread(self._device.update)
                bodies = await asyncio.to_thread(self._tracker.update)
                positions, confidence = np.full((_JOINTS, 3), np.nan), np.zeros(_JOINTS)
                if bodies.get_num_bodies():
                    positions, confidence = body_joints(bodies.get_body_skeleton(0).joints)
                yield SourceFrame(self._wall.now_ns(), positions, confidence)
        finally:
            self._device.close()


def body_joints(joints: Any) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the SDK's joints [mm] in metres, shape (32, 3), and confidence, shape (32,)."""
    places = np.array([[j.position.xyz.x, j.position.xyz.y, j.position.xyz.z] for j in joints]) * 1e-3
    confidence = np.array([_CONFIDENCE[min(int(j.confidence_level), 3)] for j in joints])
    return np.where(confidence[:, None] > 0, places, np.nan), confidence
