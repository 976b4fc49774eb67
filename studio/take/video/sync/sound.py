"""The sound of a video file, read with PyAV, on the clock of its pictures."""

from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from studio.take.video.file import opened

if TYPE_CHECKING:
    import av
    from av.container import InputContainer

RATE_HZ = 8000
"""Sampling rate of the sound; voices, steps and claps are below half of it."""

LONGEST_S = 3600.0
"""Maximum length that is read [s]; of a longer file, the first part."""

_GAP_S = 0.02
_SILENCE = 1e-5


@dataclass(frozen=True)
class Sound:
    """The sound of a video, one channel.

    Attributes:
        samples: at `RATE_HZ`, shape (sample_count,), float32; 0 where the file has none.
        begins_s: time of the first sample, counted from the video's first picture [s].
    """

    samples: NDArray[np.float32]
    begins_s: float

    @property
    def ends_s(self) -> float:
        return self.begins_s + len(self.samples) / RATE_HZ

    @property
    def silent(self) -> bool:
        """Whether nothing can be heard in it."""
        return not len(self.samples) or float(np.abs(self.samples).max()) < _SILENCE


def read_sound(path: Path) -> Sound | None:
    """Return the sound of a video, of a truncated file its readable part; None if it has none.

    Raises:
        FormatError: there is no such file, or it is no video.
    """
    from av.error import FFmpegError

    with opened(path) as container:
        if not container.streams.audio:
            return None
        pieces = _Pieces(_picture_start_s(container))
        with suppress(FFmpegError):  # cut off: what came before counts
            _decode(container, pieces)
    return pieces.sound()


def _picture_start_s(container: "InputContainer") -> float:
    for track in container.streams.video:
        if track.start_time is not None and track.time_base is not None:
            return float(track.start_time * track.time_base)
    return 0.0


def _decode(container: "InputContainer", pieces: "_Pieces") -> None:
    from av.audio.resampler import AudioResampler

    resampler = AudioResampler(format="flt", layout="mono", rate=RATE_HZ)
    for frame in container.decode(container.streams.audio[0]):
        for part in resampler.resample(frame):
            pieces.add(part)
        if pieces.full:
            return
    for part in resampler.resample(None):
        pieces.add(part)


class _Pieces:
    """Decoded pieces, put where their time stamps say; gaps are silent."""

    def __init__(self, start_s: float) -> None:
        self._start_s = start_s
        self._begins_s: float | None = None
        self._parts: list[NDArray[np.float32]] = []
        self._count = 0

    @property
    def full(self) -> bool:
        return self._count > LONGEST_S * RATE_HZ

    def add(self, frame: "av.AudioFrame") -> None:
        samples = np.asarray(frame.to_ndarray(), np.float32).reshape(-1)
        time_s = self._begins_s or 0.0
        if frame.pts is not None and frame.time_base is not None:
            time_s = float(frame.pts * frame.time_base) - self._start_s
            if self._begins_s is None:
                self._begins_s = time_s
            gap_s = time_s - self._begins_s - self._count / RATE_HZ
            if _GAP_S < gap_s < LONGEST_S:
                self._append(np.zeros(round(gap_s * RATE_HZ), np.float32))
        self._append(samples)

    def _append(self, samples: NDArray[np.float32]) -> None:
        self._parts.append(samples)
        self._count += len(samples)

    def sound(self) -> Sound:
        samples = np.concatenate(self._parts) if self._parts else np.empty(0, np.float32)
        return Sound(np.nan_to_num(samples), self._begins_s or 0.0)
