"""LTC in sound: a file, a pipe or an audio device, read with PyAV.

LTC may be on any channel of a recorder; in a file, the channel with the most timecode counts.
"""

import threading
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from studio.engine.base.errors import FormatError
from studio.engine.timecode.course import TimecodeCourse, course
from studio.engine.timecode.ltc import LtcDecoder
from studio.engine.timecode.timecode import TimecodeRate
from studio.timecode.pipe import Pipe

if TYPE_CHECKING:
    from av.container import InputContainer

_WINDOW_NS = 5_000_000_000


def samples_of(container: "InputContainer") -> Iterator[tuple[float, NDArray[np.float32]]]:
    """Yield the sound piece by piece: sample rate [Hz], and samples, shape (channel_count, sample_count)."""
    from av.audio.resampler import AudioResampler

    resampler = None
    for frame in container.decode(container.streams.audio[0]):
        if resampler is None:
            resampler = AudioResampler(format="fltp", layout=frame.layout, rate=frame.sample_rate)
        for part in resampler.resample(frame):
            yield float(frame.sample_rate), np.asarray(part.to_ndarray(), np.float32)


def ltc_of_file(path: Path, rate: TimecodeRate) -> TimecodeCourse:
    """Return the course of the LTC in a file, times counted from its first sample [s].

    Raises:
        FormatError: it cannot be read, or has no LTC of this rate.
    """
    found: dict[int, list[tuple[float, int]]] = {}
    refused = 0
    try:
        with _opened(str(path)) as container:
            decoders: list[LtcDecoder] = []
            for hz, samples in samples_of(container):
                decoders = decoders or [LtcDecoder(rate, hz) for _ in samples]
                for channel, decoder in enumerate(decoders):
                    words = decoder.feed(samples[channel])
                    found.setdefault(channel, []).extend((at / hz, frame) for at, frame in words)
            refused = sum(one.refused for one in decoders)
    except (OSError, ValueError, IndexError) as error:
        raise FormatError(
            "timecode.sound_unreadable",
            "{path} cannot be read as sound: {error}",
            path=path.name,
            error=error,
        ) from error
    best = course(max(found.values(), key=len, default=[]), rate, "ltc")
    if not best.runs:
        raise FormatError(
            "timecode.no_ltc",
            "{path} has no LTC at {rate} ({refused} words of another rate); choose the rate of the recorder",
            path=path.name,
            rate=rate.name,
            refused=refused,
        )
    return best


class LtcSource:
    """Live LTC from a device or a pipe.

    Args:
        what: a file, pipe or address that FFmpeg opens, or `<format>:<device>` such as `alsa:default`,
            `avfoundation::0`, `dshow:audio=Line In`.
        rate: rate of the timecode.
    """

    name = "ltc"

    def __init__(self, what: str, rate: TimecodeRate) -> None:
        self._format, self._what = _device(what)
        self._rate = rate
        self.refused, self.backwards = 0, False

    def run(self, clock: Any, put: Any, stopping: threading.Event) -> None:
        """Listen until `stopping`; see `TimecodeSource`."""
        with ExitStack() as open_until_the_end:
            what: str | Pipe = self._what
            if self._format is None and Path(what).is_fifo():
                what = open_until_the_end.enter_context(Pipe(what, stopping, ends=True))
            container = open_until_the_end.enter_context(_opened(what, self._format, live=True))
            decoders: list[LtcDecoder] = []
            count, offsets = 0, _Offsets()
            for hz, samples in samples_of(container):
                if stopping.is_set():
                    return
                decoders = decoders or [LtcDecoder(self._rate, hz) for _ in samples]
                count += samples.shape[1]
                begins_ns = offsets.update(clock(), count / hz * 1e9)
                words = [decoder.feed(channel) for decoder, channel in zip(decoders, samples, strict=True)]
                self.refused = sum(one.refused for one in decoders)
                self.backwards = any(one.backwards for one in decoders)
                for at, frame in max(words, key=len):
                    put(round(begins_ns + at / hz * 1e9), frame)


class _Offsets:
    """Time of the first sample on a clock, estimated from the pieces that arrived with the least delay."""

    def __init__(self) -> None:
        self._before: float | None = None
        self._now: float | None = None
        self._since_ns = 0.0

    def update(self, arrived_ns: int, sound_ns: float) -> float:
        """Return the time of the first sample [ns], given a piece's arrival and its end since the first sample."""
        offset = arrived_ns - sound_ns
        if arrived_ns - self._since_ns > _WINDOW_NS:
            self._before, self._now, self._since_ns = self._now, None, arrived_ns
        self._now = offset if self._now is None else min(offset, self._now)
        return self._now if self._before is None else min(self._before, self._now)


def _device(what: str) -> tuple[str | None, str]:
    """Split `<format>:<device>`; a path or address has no format."""
    begin, colon, rest = what.partition(":")
    devices = ("alsa", "avfoundation", "dshow", "jack", "oss", "pulse", "sndio")
    return (begin, rest) if colon and begin in devices else (None, what)


def _opened(what: "str | Pipe", kind: str | None = None, *, live: bool = False) -> "InputContainer":
    """Return an opened container; `live`: start at once, with little probing.

    Raises:
        OSError, ValueError: it cannot be opened.
    """
    import av

    few = {"fflags": "nobuffer", "probesize": "4096", "analyzeduration": "0"} if live else {}
    return av.open(what, "r", format=kind, options=few)
