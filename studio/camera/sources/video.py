"""A video file that is played as a camera."""

import asyncio
from collections.abc import AsyncIterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self

import numpy as np
from numpy.typing import NDArray

from studio.camera.sources.pacing import WallClock
from studio.camera.sources.picture_options import PictureConfig
from studio.camera.sources.posed import PictureSource, PosedSource
from studio.engine.base.errors import SettingsError
from studio.engine.base.value_sentences import bad_value
from studio.take.importers.videos import camera_name
from studio.take.video.file import VideoFile, no_frame
from studio.take.video.picture import small_picture

if TYPE_CHECKING:
    from studio.camera.sources.posed import PictureShot

_PAUSE_NS = 500_000_000
"""Pause between two rounds."""

_SPEEDS = ("1", "max")
_LATE_NS = 1_000_000_000


@dataclass(frozen=True)
class VideoConfig(PictureConfig):
    """A video, `video:<path>[?speed=max][&model=...][&mirrored][&no-hands]`.

    Attributes:
        path: its file.
        speed: "1" = in real time, in a loop; "max" = once, as fast as it is read, every frame.

    Raises:
        SettingsError: no path, or an unknown speed.
    """

    path: str | Path
    speed: str = "1"

    def __post_init__(self) -> None:
        super().__post_init__()
        if not str(self.path):
            raise SettingsError(bad_value("source", "video:", "video:<path>"))
        if self.speed not in _SPEEDS:
            raise SettingsError(bad_value("speed", repr(self.speed), _SPEEDS))

    @classmethod
    def texts(cls) -> tuple[str, ...]:
        return ("model", "speed")

    @classmethod
    def of(cls, text: str, **options: Any) -> Self:
        return cls(text, **options)

    def open(self) -> PosedSource:
        played = PlayedVideo(VideoFile.open(self.path), realtime=self.speed != "max")
        return PosedSource(played, self.model, mirrored=self.mirrored, hands=self.hands)

    def picture(self) -> NDArray[np.uint8]:
        for _, frame in VideoFile.open(self.path).frames():
            return small_picture(frame, mirrored=self.mirrored).image
        raise no_frame(Path(self.path))


class PlayedVideo(PictureSource):
    """Plays a video.

    In real time it loops in step with the wall clock, so that clients with videos of one length play the same
    moment; frames have the time of the wall clock. If this machine cannot decode that fast, it continues at a later
    keyframe. Otherwise it plays once, every frame, with the video's own times.

    Args:
        video: to play.
        realtime: see above.
    """

    def __init__(self, video: VideoFile, *, realtime: bool) -> None:
        self.name, self.device = camera_name(video.path), f"video {video.path.name}"
        self.frames_per_second, self.realtime = video.frames_per_second, realtime
        self._video = video
        self._wall = WallClock()
        self._newest_ns = 0

    @property
    def problem(self) -> str:
        return self._video.damage

    def clock_ns(self) -> int:
        return self._wall.now_ns() if self.realtime else self._newest_ns

    async def frames(self) -> "AsyncIterator[PictureShot]":
        if not self.realtime:
            frames = self._video.frames()
            while (shot := await asyncio.to_thread(next, frames, None)) is not None:
                self._newest_ns = shot[0]
                yield shot
            return
        period_ns = round(self._video.duration_s * 1e9) + _PAUSE_NS
        now_ns = self._wall.now_ns()
        round_ns = now_ns - now_ns % period_ns
        while True:
            begin_ns, shot = round_ns, None
            frames = self._video.frames(lambda begin_ns=begin_ns: self._wall.now_ns() - begin_ns - _LATE_NS)
            while (shot := await asyncio.to_thread(next, frames, None)) is not None:
                await self._wall.wait_until(round_ns + shot[0])
                yield round_ns + shot[0], shot[1]
            round_ns += period_ns
            await self._wall.wait_until(round_ns)
