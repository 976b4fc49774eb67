"""Kinect v2 on Windows, with pykinect2 and the Kinect SDK 2.0: its depth, or with `?bodies` its body tracking."""

from collections.abc import AsyncIterator
from dataclasses import dataclass
from time import sleep
from typing import Any, Self

import numpy as np

from studio.camera.devices.common import library, polled, split_argument
from studio.camera.devices.plugged import seen_without_library
from studio.camera.sources.config import DeviceConfig, FoundDevice
from studio.camera.sources.depth_source import DepthShot, DepthSource
from studio.camera.sources.pacing import WallClock
from studio.camera.sources.source import Source, SourceFrame
from studio.engine.base.errors import NotAvailableError, SettingsError
from studio.engine.model.cameras.depth import DepthCamera

_KIND = "kinect-v2"
_WIDTH, _HEIGHT = 512, 424
_CONFIDENCE = (0.0, 0.4, 1.0)
"""For the SDK's states not tracked, inferred, tracked."""

_POLL_S = 0.005
_INSTALL = "pip install pykinect2, on Windows with the Kinect SDK 2.0"


@dataclass(frozen=True)
class KinectV2Config(DeviceConfig):
    """The Kinect v2 of this computer, `kinect-v2[?bodies]`.

    Attributes:
        bodies: give the skeletons of the SDK's body tracking instead of depth.
    """

    bodies: bool = False

    @classmethod
    def parse(cls, text: str) -> Self:
        text, flags = split_argument(text, _KIND, ("bodies",))
        if text not in ("", "0"):
            raise SettingsError(
                "source.one_kinect",
                "source {kind}:{text} is not allowed: the SDK opens one Kinect v2 for each computer",
                kind=_KIND,
                text=text,
            )
        return cls("bodies" in flags)

    @classmethod
    def find(cls) -> list[FoundDevice]:
        try:
            library("pykinect2.PyKinectV2", kind=_KIND, install=_INSTALL)
        except NotAvailableError as error:
            return seen_without_library(_KIND, error)
        raise NotAvailableError(
            "device.kinect_v2_unlisted",
            "the Kinect SDK 2.0 does not say whether a Kinect v2 is plugged in; start it by the command",
        )

    def open(self) -> "KinectV2Source | KinectV2Bodies":
        constants = library("pykinect2.PyKinectV2", kind=_KIND, install=_INSTALL)
        runtime = library("pykinect2.PyKinectRuntime", kind=_KIND, install=_INSTALL)
        wanted = constants.FrameSourceTypes_Body if self.bodies else constants.FrameSourceTypes_Depth
        try:
            kinect = runtime.PyKinectRuntime(wanted)
        except OSError as error:
            raise NotAvailableError(
                "device.no_kinect_sdk",
                "source {kind}: the Kinect SDK 2.0 does not answer ({error})",
                kind=_KIND,
                error=error,
            ) from error
        return KinectV2Bodies(kinect) if self.bodies else KinectV2Source(kinect)


class KinectV2Source(DepthSource):
    """The depth stream; the SDK's image is mirrored and is flipped here."""

    name, device = "kinect-v2", "Kinect v2"

    def __init__(self, kinect: Any) -> None:
        self._kinect = kinect
        lens = kinect._mapper.GetDepthCameraIntrinsics()
        self.camera = DepthCamera(
            lens.FocalLengthX,
            lens.FocalLengthY,
            _WIDTH - 1 - lens.PrincipalPointX,
            lens.PrincipalPointY,
            _WIDTH,
            _HEIGHT,
            (
                lens.RadialDistortionSecondOrder,
                lens.RadialDistortionFourthOrder,
                0.0,
                0.0,
                lens.RadialDistortionSixthOrder,
            ),
        )
        self._wall = WallClock()

    def clock_ns(self) -> int:
        return self._wall.now_ns()

    async def frames(self) -> AsyncIterator[DepthShot]:
        def wait() -> DepthShot | None:
            if not self._kinect.has_new_depth_frame():
                sleep(_POLL_S)
                return None
            image = np.array(self._kinect.get_last_depth_frame(), dtype=np.uint16).reshape(_HEIGHT, _WIDTH)
            return self._wall.now_ns(), np.ascontiguousarray(image[:, ::-1])

        async for shot in polled(wait, self._kinect.close):
            yield shot


class KinectV2Bodies(Source):
    """The nearest body of the SDK's tracker."""

    name, device, joint_set = "kinect-v2", "Kinect v2, SDK body tracking", "kinect-v2"

    def __init__(self, kinect: Any) -> None:
        self._kinect = kinect
        self._wall = WallClock()

    def clock_ns(self) -> int:
        return self._wall.now_ns()

    async def frames(self) -> AsyncIterator[SourceFrame]:
        from studio.take.importers.kinect_v2.joint_set import to_camera  # slow to load

        def wait() -> SourceFrame | None:
            if not self._kinect.has_new_body_frame():
                sleep(_POLL_S)
                return None
            bodies = [body for body in self._kinect.get_last_body_frame().bodies if body.is_tracked]
            if not bodies:
                return None
            body = min(bodies, key=lambda body: body.joints[0].Position.z)
            joints = [body.joints[k] for k in range(25)]
            places = np.array([[j.Position.x, j.Position.y, j.Position.z] for j in joints])
            confidence = np.array([_CONFIDENCE[min(int(j.TrackingState), 2)] for j in joints])
            places = np.where(confidence[:, None] > 0, to_camera(places), np.nan)
            return SourceFrame(self._wall.now_ns(), places, confidence)

        async for frame in polled(wait, self._kinect.close):
            yield frame
