"""A camera of ordinary pictures as a source of landmarks."""

from abc import abstractmethod
from collections.abc import AsyncIterator, Callable
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from studio.camera.sources.reading import ReadingSource
from studio.camera.sources.source import Camera, SourceFrame
from studio.engine.seeing.pictures.problems import NOBODY, several, too_many_pictures
from studio.take.video.landmarks import JOINT_SET, LANDMARKS, LandmarkReader
from studio.take.video.picture import small_picture

if TYPE_CHECKING:
    import av

    PictureShot = tuple[int, av.VideoFrame]
    """Capture time on the source's clock [ns], and the decoded frame."""

_ENOUGH_HZ = 15.0
_ENOUGH = 0.75
"""Skipped pictures are reported if the rate read is below `_ENOUGH_HZ` and below this share of the nominal rate."""


class PictureSource(Camera):
    """A camera of pictures; `PosedSource` finds the landmarks in them."""

    @abstractmethod
    def frames(self) -> "AsyncIterator[PictureShot]":
        """Yield pictures as they come; ends with the source.

        Raises:
            DeviceLostError: the device is lost; opening the source again may find it.
        """


class PosedSource(ReadingSource["av.VideoFrame"]):
    """A source of landmarks made from pictures.

    A picture without anybody gives a frame in which nothing is seen.

    Args:
        pictures: the camera.
        model: see `PoseFinder`.
        mirrored: the camera swaps left and right, as selfie cameras do.
        hands: look for the hands too.

    Raises:
        FormatError, NotAvailableError: as for `PoseFinder`.

    Attributes:
        mirrored: as given.
        on_picture: called with every picture as it comes, also with skipped ones; None = not called.
    """

    joint_set = JOINT_SET

    def __init__(
        self,
        pictures: PictureSource,
        model: str | Path = "full",
        *,
        mirrored: bool = False,
        hands: bool = True,
    ) -> None:
        super().__init__(pictures)
        self._pictures, self.mirrored = pictures, mirrored
        self.on_picture: Callable[[int, av.VideoFrame], None] | None = None
        self._reader = LandmarkReader(model, hands=hands)
        self._people = 1

    @property
    def problem(self) -> str:
        if self._pictures.problem:
            return self._pictures.problem
        if self._people == 0:
            return NOBODY
        if self._people > 1:
            return several(self._people)
        enough_hz = min(_ENOUGH * self.frames_per_second, _ENOUGH_HZ)
        if self.settled and self.realtime and self.measured_rate < enough_hz:
            return too_many_pictures(self.measured_rate, self.frames_per_second)
        return ""

    def frames(self) -> AsyncIterator[SourceFrame]:
        return self.read_all(self._heard())

    async def _heard(self) -> "AsyncIterator[PictureShot]":
        async for shot in self._pictures.frames():
            if self.on_picture is not None:
                self.on_picture(*shot)
            yield shot

    def read(self, time_ns: int, image: "av.VideoFrame") -> SourceFrame:
        seen, pose = self._reader.read(small_picture(image, mirrored=self.mirrored))
        self._people = 0 if pose is None else pose.people
        return SourceFrame(
            time_ns,
            np.full((LANDMARKS, 3), np.nan),
            np.zeros(LANDMARKS) if pose is None else pose.visibility,
            picture=seen,
        )
