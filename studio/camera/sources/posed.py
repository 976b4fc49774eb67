"""A camera of ordinary pictures as a source of landmarks."""

import asyncio
import time
from abc import abstractmethod
from collections import deque
from collections.abc import AsyncIterator
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from studio.camera.sources.newest import newest_of
from studio.camera.sources.source import Camera, Source, SourceFrame, SourcePicture
from studio.engine.model.joints import JOINT_SETS
from studio.engine.seeing.pictures.poses import PoseFinder
from studio.engine.seeing.pictures.problems import NOBODY, several, too_many_pictures
from studio.take.video.landmarks import JOINT_SET
from studio.take.video.picture import small_picture

if TYPE_CHECKING:
    import av

    PictureShot = tuple[int, av.VideoFrame]
    """Capture time on the source's clock [ns], and the decoded frame."""

_RATE_FRAMES = 60
_COUNT = len(JOINT_SETS[JOINT_SET])
_ENOUGH_HZ = 15.0
_ENOUGH = 0.75
"""It is told that pictures are skipped where fewer than this share of them, and fewer than enough, are read."""


class PictureSource(Camera):
    """A camera of pictures; `PosedSource` finds the landmarks in them."""

    @abstractmethod
    def frames(self) -> "AsyncIterator[PictureShot]":
        """Yield pictures as they come; ends with the source.

        Raises:
            DeviceLostError: the device is lost; opening the source again may find it.
        """


class PosedSource(Source):
    """A source of landmarks made from pictures.

    Of a camera in real time the newest picture is read: those that come meanwhile are skipped. A picture without
    anybody gives a frame in which nothing is seen.

    Args:
        pictures: the camera.
        model: see `PoseFinder`.
        mirrored: the camera exchanges left and right, as selfie cameras do.

    Raises:
        FormatError, NotAvailableError: as for `PoseFinder`.

    Attributes:
        passed_over: number of pictures that were skipped.
    """

    joint_set = JOINT_SET

    def __init__(
        self, pictures: PictureSource, model: str | Path = "full", *, mirrored: bool = False
    ) -> None:
        self._pictures, self._mirrored = pictures, mirrored
        self._finder = PoseFinder(model)
        self.name, self.device, self.serial = pictures.name, pictures.device, pictures.serial
        self.frames_per_second, self.realtime = pictures.frames_per_second, pictures.realtime
        self._read_ns = 0
        self._reading_since_ns: int | None = None
        self._done_ns: deque[int] = deque(maxlen=_RATE_FRAMES)
        self._people = 1
        self.passed_over = 0

    @property
    def tracked_ns(self) -> int:
        """Total time in which pictures were read, including the present one [ns]."""
        since_ns = self._reading_since_ns
        return self._read_ns + (0 if since_ns is None else time.monotonic_ns() - since_ns)

    @property
    def measured_rate(self) -> float:
        """Frame rate of the last frames, by their stamps; 0 before the second."""
        if len(self._done_ns) < 2 or self._done_ns[-1] <= self._done_ns[0]:
            return 0.0
        return (len(self._done_ns) - 1) * 1e9 / (self._done_ns[-1] - self._done_ns[0])

    @property
    def problem(self) -> str:
        if self._pictures.problem:
            return self._pictures.problem
        if self._people == 0:
            return NOBODY
        if self._people > 1:
            return several(self._people)
        many = len(self._done_ns) == _RATE_FRAMES and self.realtime
        if many and self.measured_rate < min(_ENOUGH * self.frames_per_second, _ENOUGH_HZ):
            return too_many_pictures(self.measured_rate, self.frames_per_second)
        return ""

    def clock_ns(self) -> int:
        return self._pictures.clock_ns()

    async def frames(self) -> AsyncIterator[SourceFrame]:
        shots = self._pictures.frames()
        async for time_ns, picture in newest_of(shots, self._passed) if self.realtime else shots:
            self._reading_since_ns = time.monotonic_ns()
            frame = await asyncio.to_thread(self._read, time_ns, picture)
            self._read_ns, self._reading_since_ns = self.tracked_ns, None
            self._done_ns.append(time_ns)
            yield frame

    def _passed(self, count: int) -> None:
        self.passed_over += count

    def _read(self, time_ns: int, frame: "av.VideoFrame") -> SourceFrame:
        picture = small_picture(frame, mirrored=self._mirrored)
        pose = self._finder.find(picture.image)
        self._people = 0 if pose is None else pose.people
        unseen = np.full((_COUNT, 3), np.nan)
        if pose is None:
            nowhere = SourcePicture(picture.width, picture.height, unseen[:, :2])
            return SourceFrame(time_ns, unseen, np.zeros(_COUNT), picture=nowhere)
        place = SourcePicture(picture.width, picture.height, picture.whole(pose.pixels), pose.world_m)
        return SourceFrame(time_ns, unseen, pose.visibility, picture=place)
