"""Video files, read with PyAV."""

import contextlib
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import UTC, datetime
from fractions import Fraction
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from studio.engine.base.errors import FormatError
from studio.engine.base.sentences import say

if TYPE_CHECKING:
    import av
    from av.container import InputContainer
    from av.video.stream import VideoStream

ENDINGS = (".mp4", ".mov", ".m4v", ".mkv", ".webm", ".avi", ".mts", ".3gp", ".ivf")
"""Endings of files that may be videos."""

_SMALLEST = 16


def is_video(path: Path) -> bool:
    """Whether a file is a video by its ending; a recording of an Azure Kinect, which has depth, is none."""
    if not path.is_file() or path.suffix.lower() not in ENDINGS:
        return False
    if path.suffix.lower() != ".mkv":
        return True
    try:
        with opened(path) as container:
            return not any("K4A_DEPTH_MODE" in track.metadata for track in container.streams.video)
    except FormatError:
        return False


@dataclass
class VideoFile:
    """A video file.

    Attributes:
        path: its file.
        frames_per_second: average, as the file states.
        duration_s: length, as the file states; 0 = unknown.
        created: time of the recording as the file states, ISO 8601 in UTC; "" = unknown.
        timecode: of its first frame; "" = none.
        damage: what could not be read, once its frames were read; "" = nothing.
    """

    path: Path
    frames_per_second: float
    duration_s: float
    created: str
    timecode: str
    damage: str = ""

    @classmethod
    def open(cls, path: str | Path) -> "VideoFile":
        """Return a video file, without reading its frames.

        Raises:
            FormatError: there is no such file, or it is no video.
        """
        path = Path(path)
        with opened(path) as container:
            track = _track(path, container)
            tags = {name.lower(): value for name, value in {**track.metadata, **container.metadata}.items()}
            length_s = float((track.duration or 0) * track.time_base) if track.time_base else 0.0
            rate = track.average_rate or track.guessed_rate
            timecode = (stream.metadata.get("timecode", "") for stream in container.streams)
            return cls(
                path=path,
                frames_per_second=float(rate) if rate else 30.0,
                duration_s=length_s or (container.duration or 0) * 1e-6,
                created=_utc(tags.get("creation_time", "")),
                timecode=tags.get("timecode", "") or next(filter(None, timecode), ""),
            )

    def frames(
        self, past_ns: Callable[[], int] | None = None, *, from_ns: int = 0
    ) -> "Iterator[tuple[int, av.VideoFrame]]":
        """Yield time since the beginning of the video [ns], increasing, and frame.

        A damaged frame is left out; a file that is cut off ends early. `damage` says so afterwards.

        Args:
            past_ns: the time [ns] before which frames are no longer wanted; they are skipped up to the next
                keyframe. None = all are wanted.
            from_ns: begin at the keyframe before this time [ns], if the file allows finding it.

        Raises:
            FormatError: it can no longer be opened.
        """
        from av.error import FFmpegError

        damaged, newest_ns, cut, skipping = 0, -1, "", False
        with opened(self.path) as container:
            track = _track(self.path, container)
            track.thread_type = "AUTO"
            start, unit = track.start_time or 0, (track.time_base or Fraction(1)) * 10**9
            if from_ns > 0:
                with contextlib.suppress(
                    FFmpegError
                ):  # without a list of keyframes it is read from its beginning
                    container.seek(start + int(from_ns / unit), stream=track)
            packets = container.demux(track)
            while True:
                try:
                    packet = next(packets, None)
                except FFmpegError as error:
                    cut = error.strerror or str(error)
                    break
                if packet is None:
                    break
                if past_ns is not None and packet.pts is not None:
                    late = (packet.pts - start) * unit < past_ns()
                    skipping = late if packet.is_keyframe else skipping or late
                    if skipping:
                        continue
                try:
                    decoded = packet.decode()
                except FFmpegError:
                    damaged += 1
                    continue
                for frame in decoded:
                    time_ns = newest_ns + 1 if frame.pts is None else round((frame.pts - start) * unit)
                    if time_ns > newest_ns and min(frame.width, frame.height) >= _SMALLEST:
                        newest_ns = time_ns
                        yield time_ns, frame
        if not skipping:
            self.damage = self._said(damaged, cut, newest_ns)

    def times_ns(self) -> NDArray[np.int64]:
        """Return the times of the frames since the beginning of the video [ns], without decoding them.

        Raises:
            FormatError: it can no longer be opened.
        """
        from av.error import FFmpegError

        found: list[int] = []
        with opened(self.path) as container, contextlib.suppress(FFmpegError):
            track = _track(self.path, container)
            start, unit = track.start_time or 0, (track.time_base or Fraction(1)) * 10**9
            for packet in container.demux(track):
                if packet.pts is not None and packet.size:
                    found.append(round((packet.pts - start) * unit))
        return np.unique(np.array(found, np.int64))

    def size(self) -> tuple[int, int]:
        """Return width and height of the pictures, upright [pixels].

        Raises:
            FormatError: no frame can be read.
        """
        for _, frame in self.frames():
            turned = round(frame.rotation / 90) % 2
            return (frame.height, frame.width) if turned else (frame.width, frame.height)
        raise no_frame(self.path)

    def _said(self, damaged: int, cut: str, newest_ns: int) -> str:
        if cut or (self.duration_s and newest_ns * 1e-9 < 0.9 * self.duration_s - 1.0):
            return say(
                "video.cut_off",
                "{name} is cut off after {seconds:.1f} of {whole:.1f} s; what is there was read",
                name=self.path.name,
                seconds=max(newest_ns, 0) * 1e-9,
                whole=self.duration_s,
            )
        if damaged:
            return say(
                "video.damaged",
                "{name}: {n} frames are damaged and were left out",
                name=self.path.name,
                n=damaged,
            )
        return ""


def no_frame(path: Path) -> FormatError:
    """Return the error for a video without a readable frame."""
    return FormatError("video.no_frame", "no frame of {path} can be read; is the file whole?", path=path)


@contextmanager
def opened(path: Path) -> "Iterator[InputContainer]":
    import av
    from av.error import FFmpegError

    if not path.is_file():
        raise FormatError("video.none", "no video at {path}: there is no such file", path=path)
    try:
        container = av.open(str(path), "r")
    except (FFmpegError, OSError, UnicodeDecodeError) as error:
        raise FormatError(
            "video.unreadable",
            "{path} is no video that can be read ({error}); a file that was cut off while it was recorded may lack "
            "its list of frames",
            path=path,
            error=getattr(error, "strerror", "") or str(error),
        ) from error
    with container:
        yield container


def _track(path: Path, container: "InputContainer") -> "VideoStream":
    tracks = [one for one in container.streams.video if one.disposition.name != "attached_pic"]
    if not tracks:
        raise FormatError("video.no_track", "{path} has no pictures in it; give a video", path=path)
    return tracks[0]


def _utc(text: str) -> str:
    """Return a time of ISO 8601 in UTC, "" if it is none or a camera without a clock wrote it."""
    try:
        time = datetime.fromisoformat(text.strip())
    except ValueError:
        return ""
    time = time if time.tzinfo else time.replace(tzinfo=UTC)
    return "" if time.year < 1990 else time.astimezone(UTC).isoformat()
