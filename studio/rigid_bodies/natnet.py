"""NatNet 3 and 4, as OptiTrack's Motive sends it: names of rigid bodies, and where each is.

Source: OptiTrack's public documentation of the protocol, "NatNet: Class/Function Reference" and "Direct
depacketization" (the sample client in Python). All is little-endian. Of a frame only the rigid bodies are read, which
stand behind marker sets and unlabelled markers; skeletons, labelled markers and what else follows is passed over.
"""

import math
import struct

from studio.engine.rigid_bodies.known import MOST_BODIES
from studio.engine.rigid_bodies.reading import BodyReading

CONNECT, SERVER_INFO, REQUEST_MODEL, MODEL, FRAME, KEEP_ALIVE = 0, 1, 4, 5, 7, 10
PORT, DATA_PORT = 1510, 1511
LONGEST = 65_507
_MOST = 10_000
_LONGEST_NAME = 64
_UNNAMED = 500
"""So many frames are waited for names; then numbers stand for them."""

_SIZED = (4, 1)
"""From this version on each part has its size in bytes."""


def request(kind: int, text: str = "") -> bytes:
    """Return a message to the server."""
    payload = text.encode() + b"\0" if text or kind in (CONNECT, KEEP_ALIVE) else b""
    return struct.pack("<HH", kind, len(payload)) + payload


class _Cut(Exception):
    """A packet that is no NatNet."""


class _Packet:
    """Reads a packet from its front."""

    def __init__(self, data: bytes) -> None:
        self._data = data
        self._at = 0

    def numbers(self, form: str) -> tuple[float, ...]:
        """Return numbers, as `struct` writes them."""
        try:
            found = struct.unpack_from("<" + form, self._data, self._at)
        except struct.error as error:
            raise _Cut from error
        self._at += struct.calcsize("<" + form)
        return found

    def count(self) -> int:
        """Return a number of parts."""
        (value,) = self.numbers("i")
        if not 0 <= value <= _MOST:
            raise _Cut
        return int(value)

    def text(self) -> str:
        """Return a text, which a zero ends."""
        end = self._data.find(b"\0", self._at, self._at + 256)
        if end < 0:
            raise _Cut
        found = self._data[self._at : end].decode("utf-8", "replace")
        self._at = end + 1
        return found

    def skip(self, size: int) -> None:
        """Pass over so many bytes."""
        self.part(size)

    def part(self, size: int) -> "_Packet":
        """Return so many bytes as a packet of their own, and pass over them."""
        if size < 0 or self._at + size > len(self._data):
            raise _Cut
        self._at += size
        return _Packet(self._data[self._at - size : self._at])


class NatNetDecoder:
    """Finds rigid bodies in the packets of one server.

    Attributes:
        version: of the stream, major and minor; None = the server has not told it.
        server: the program that sends, "" = not told.
        refused: packets that were no NatNet, or of a version that is not read.
    """

    def __init__(self) -> None:
        self.version: tuple[int, int] | None = None
        self.server = ""
        self.refused = 0
        self._names: dict[int, str] = {}
        self._unnamed = 0

    @property
    def knows_names(self) -> bool:
        """Whether the server has described its rigid bodies."""
        return bool(self._names)

    def feed(self, data: bytes) -> list[BodyReading]:
        """Return the rigid bodies of a packet; none where it has none, or is refused."""
        try:
            if len(data) > LONGEST:
                raise _Cut
            packet = _Packet(data)
            kind, size = packet.numbers("HH")
            if size > len(data) - 4:
                raise _Cut
            if kind == SERVER_INFO:
                self._read_server(packet)
            elif kind == MODEL and self.version is not None:
                self._names = self._read_names(packet, self.version)
            elif kind == FRAME and self.version is not None:
                found = self._read_frame(packet, self.version)
                self._unnamed += not self._names
                return found if self._names or self._unnamed > _UNNAMED else []
        except _Cut:
            self.refused += 1
        return []

    def _read_server(self, packet: _Packet) -> None:
        name = packet.text()
        packet.skip(256 - len(name.encode()) - 1 if len(name.encode()) < 256 else 0)
        packet.numbers("4B")  # of the program
        major, minor, _, _ = packet.numbers("4B")
        if major not in (3, 4):
            raise _Cut
        self.server, self.version = name[:_LONGEST_NAME], (int(major), int(minor))

    def _read_names(self, packet: _Packet, version: tuple[int, int]) -> dict[int, str]:
        names: dict[int, str] = {}
        for _ in range(packet.count()):
            (kind,) = packet.numbers("i")
            part, size = packet, None
            if version >= _SIZED:
                size = int(packet.numbers("i")[0])
                part = packet.part(size)  # what later versions add at its end is passed over
            if kind == 1:
                number, name = _rigid_body_description(part, version)
                if len(names) < MOST_BODIES:
                    names[number] = name[:_LONGEST_NAME] or f"body {number}"
            elif size is not None:
                continue
            elif kind == 0:
                packet.text()
                for _ in range(packet.count()):
                    packet.text()
            elif kind == 2:
                packet.text()
                packet.numbers("i")
                for _ in range(packet.count()):
                    _rigid_body_description(packet, version)
            else:
                break  # plates, devices and cameras come last
        return names

    def _read_frame(self, packet: _Packet, version: tuple[int, int]) -> list[BodyReading]:
        sized = version >= _SIZED
        packet.numbers("i")  # number of the frame
        sets = packet.count()
        if sized:
            packet.skip(int(packet.numbers("i")[0]))
        else:
            for _ in range(sets):
                packet.text()
                packet.skip(12 * packet.count())
        markers = packet.count()
        if sized:
            packet.skip(int(packet.numbers("i")[0]))
        else:
            packet.skip(12 * markers)
        bodies = packet.count()
        if sized:
            packet.numbers("i")
        if bodies > MOST_BODIES:
            raise _Cut
        found = []
        for _ in range(bodies):
            number, *pose = packet.numbers("i7f")
            _, told = packet.numbers("fh")  # mean error of its markers [m]; bit 0: it was tracked
            found.append(self._reading(int(number), pose, bool(int(told) & 1)))
        return found

    def _reading(self, number: int, pose: list[float], tracked: bool) -> BodyReading:
        if not is_pose(pose):
            tracked, pose = False, [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0]
        x, y, z, qx, qy, qz, qw = pose
        name = self._names.get(number, f"body {number}")
        return BodyReading(name, (x, y, z), (qx, qy, qz, qw), tracked)


def _rigid_body_description(packet: _Packet, version: tuple[int, int]) -> tuple[int, str]:
    """Read the description of a rigid body; return its number and name."""
    name = packet.text()
    (number,) = packet.numbers("i")
    packet.skip(4 + 12 + (16 if version >= (4, 2) else 0))  # parent, offset, rotation
    markers = packet.count()
    packet.skip(16 * markers)  # places, labels
    if version >= (4, 0):
        for _ in range(markers):
            packet.text()
    return int(number), name


FARTHEST_M = 1000.0


def is_pose(numbers: list[float]) -> bool:
    """Whether x, y, z [m] and a quaternion may be a pose: finite, near, of length 1."""
    if len(numbers) != 7 or not all(math.isfinite(one) for one in numbers):
        return False
    return max(map(abs, numbers[:3])) <= FARTHEST_M and abs(math.hypot(*numbers[3:]) - 1.0) < 0.1
