"""Depth cameras in software for tests of the client, and observers that need no tracker."""

import asyncio
from collections.abc import AsyncIterator
from dataclasses import replace

import numpy as np

from studio.camera.sources.depth_source import DepthShot, DepthSource
from studio.engine.base.errors import StudioError
from studio.engine.model.cameras.depth import DepthCamera
from studio.engine.model.cameras.observation import Observation
from studio.engine.model.frames import HandSeen
from studio.engine.model.joints import JOINT_COUNT

CAMERA = DepthCamera(60.0, 60.0, 31.5, 23.5, 64, 48)


class Device(DepthSource):
    """Gives `count` images, numbered by their depth, and then ends, fails or falls silent."""

    name, device = "camera", "software camera"

    def __init__(
        self, count: int, end: str = "end", camera: DepthCamera = CAMERA, *, realtime: bool = True
    ) -> None:
        self.camera, self._count, self._end, self.realtime = camera, count, end, realtime

    def clock_ns(self) -> int:
        return 0

    async def frames(self) -> AsyncIterator[DepthShot]:
        for k in range(self._count):
            await asyncio.sleep(0.001)
            yield 7_000_000 + k * 1_000_000, np.full((48, 64), 1000 + k, np.uint16)
        if self._end == "raise":
            raise RuntimeError("the cable is out")
        if self._end == "silent":
            await asyncio.sleep(60)


class FixedObserver:
    """Finds the same skeleton in every image, its hips as deep as the image says."""

    def __init__(self, name: str, camera: DepthCamera) -> None:
        self._camera = camera

    def observe(self, time_ns: int, depth_mm: np.ndarray) -> Observation:
        if depth_mm[0, 0] == 13:
            raise ValueError("number thirteen")
        positions = np.full((JOINT_COUNT, 3), np.nan)
        positions[0] = [0.0, 0.0, depth_mm[0, 0] * 1e-3]
        hands = (HandSeen("left", "shape", 0.75),)
        return Observation(time_ns, positions, np.full(JOINT_COUNT, 0.5), hands, (1.0, 0.0, 0.0, 0.0))


class CoupleObserver(FixedObserver):
    """Finds a second body, a metre to the right."""

    def observe(self, time_ns: int, depth_mm: np.ndarray) -> Observation:
        first = super().observe(time_ns, depth_mm)
        beside = first.positions + np.array([1.0, 0.0, 0.0])
        return replace(first, others=(replace(first, positions=beside, head_wxyz=None, body=4),))


class BrokenObserver:
    def __init__(self, name: str, camera: DepthCamera) -> None:
        raise StudioError("no weights here")
