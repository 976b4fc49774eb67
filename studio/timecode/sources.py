"""Sources of timecode: `clock`, `ltc:<device or file>`, `mtc:<MIDI device>`, `artnet[:<address>]`."""

import socket
import threading
from collections.abc import Callable
from datetime import datetime
from typing import Protocol

from studio.engine.base.errors import SettingsError
from studio.engine.timecode import artnet
from studio.engine.timecode.mtc import MtcDecoder
from studio.engine.timecode.timecode import TimecodeRate, at_seconds
from studio.timecode.pipe import WAIT_S, Pipe
from studio.timecode.sound import LtcSource

Clock = Callable[[], int]
"""The server's clock [ns]."""

Put = Callable[[int, int], None]
"""Takes a reading: when the frame began on the server's clock [ns], and the frame since midnight."""

_MOST_BYTES = 2048


class TimecodeSource(Protocol):
    """A source of timecode.

    Attributes:
        name: as in a take's file.
    """

    name: str

    @property
    def refused(self) -> int:
        """Number of received timecodes of another rate."""
        ...

    @property
    def backwards(self) -> bool:
        """Whether it runs backwards, where that can be detected."""
        ...

    def run(self, clock: Clock, put: Put, stopping: threading.Event) -> None:
        """Listen until `stopping` is set, or until the source has ended.

        Raises:
            OSError, ValueError, StudioError: it cannot be opened, or was lost.
        """
        ...


class ClockSource:
    """The system's time of day, read at the start and then counted at the rate."""

    name, backwards = "clock", False

    def __init__(self, rate: TimecodeRate) -> None:
        self._rate = rate
        self.refused = 0

    def run(self, clock: Clock, put: Put, stopping: threading.Event) -> None:
        """Report a frame ten times a second."""
        now, begins_ns = datetime.now().astimezone(), clock()
        seconds = (now.hour * 60 + now.minute) * 60 + now.second + now.microsecond * 1e-6
        first = at_seconds(seconds, self._rate).frame
        while not stopping.wait(0.1):
            frames = int((clock() - begins_ns) * 1e-9 * self._rate.exact)
            put(
                begins_ns + round(frames / self._rate.exact * 1_000_000_000),
                (first + frames) % self._rate.day,
            )


class MidiTimecode:
    """MIDI timecode from a device whose file gives bytes, such as `/dev/snd/midiC1D0` on Linux."""

    name, backwards = "mtc", False

    def __init__(self, path: str, rate: TimecodeRate) -> None:
        self._path = path
        self._decoder = MtcDecoder(rate)

    @property
    def refused(self) -> int:
        return self._decoder.refused

    def run(self, clock: Clock, put: Put, stopping: threading.Event) -> None:
        """Read the device."""
        read_midi(self._path, stopping, lambda data: [put(*one) for one in self._decoder.feed(data, clock())])


def read_midi(path: str, stopping: threading.Event, take: Callable[[bytes], object]) -> None:
    """Give the bytes of a MIDI device's file to `take` as they arrive, until `stopping` is set.

    Raises:
        OSError: it cannot be opened, or was unplugged.
    """
    with Pipe(path, stopping, ends=False) as device:
        while data := device.read(_MOST_BYTES):
            take(data)


class ArtNetTimecode:
    """Art-Net timecode on an address of this machine."""

    name, backwards = "artnet", False

    def __init__(self, host: str, port: int, rate: TimecodeRate) -> None:
        self._address = host, port
        self._rate = rate
        self.refused = 0

    def run(self, clock: Clock, put: Put, stopping: threading.Event) -> None:
        """Receive packets."""
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as channel:
            channel.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            channel.bind(self._address)
            channel.settimeout(WAIT_S)
            while not stopping.is_set():
                try:
                    data = channel.recv(_MOST_BYTES)
                except TimeoutError:
                    continue
                frame = artnet.frame_of_packet(data, self._rate)
                if frame is None:
                    self.refused += 1
                else:
                    put(clock(), frame)


def open_source(text: str, rate: TimecodeRate) -> TimecodeSource:
    """Return the source that a text names.

    Raises:
        SettingsError: there is no such source.
    """
    kind, _, what = text.partition(":")
    if kind == "clock" and not what:
        return ClockSource(rate)
    if kind == "ltc" and what:
        return LtcSource(what, rate)
    if kind == "mtc" and what:
        return MidiTimecode(what, rate)
    if kind == "artnet":
        host, _, port = (what or "127.0.0.1").partition(":")
        if not port or (port.isascii() and port.isdigit() and 0 < int(port) < 65536):
            return ArtNetTimecode(host, int(port or artnet.PORT), rate)
    raise SettingsError(
        "timecode.source",
        "timecode={source} is not allowed; allowed: off, clock, ltc:<device or file>, mtc:<MIDI device>, "
        "artnet[:<address>[:<port>]]",
        source=text[:80],
    )
