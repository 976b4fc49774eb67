"""NatNet 3 and 4, as OptiTrack's Motive sends it: rigid bodies with their names, and markers.

Source: OptiTrack's public documentation of the protocol, "NatNet: Class/Function Reference" and "Direct
depacketization" (the sample client in Python). All is little-endian. Rigid bodies and labelled and unlabelled markers
of a frame are read; marker sets, skeletons, trained assets, plates and devices are skipped.
"""

import math
import struct

from studio.engine.rigid_bodies.known import MOST_BODIES
from studio.engine.rigid_bodies.markers import MOST_MARKERS, MarkersReading, Place
from studio.engine.rigid_bodies.reading import BodyReading
from studio.rigid_bodies.content import PacketContent
from studio.rigid_bodies.natnet_model import LONGEST_NAME, SIZED, NatNetModel, read_model
from studio.rigid_bodies.packets import CutError, Packet

CONNECT, SERVER_INFO, REQUEST_MODEL, MODEL, FRAME, KEEP_ALIVE = 0, 1, 4, 5, 7, 10
PORT, DATA_PORT = 1510, 1511
LONGEST = 65_507
FARTHEST_M = 1000.0
_UNNAMED = 500
"""Number of frames that wait for names; afterwards numbers replace unknown names."""

_OCCLUDED, _UNLABELLED = 0x01, 0x10
_BODY_BYTES = 38


def request(kind: int, text: str = "") -> bytes:
    """Return a message to the server."""
    payload = text.encode() + b"\0" if text or kind in (CONNECT, KEEP_ALIVE) else b""
    return struct.pack("<HH", kind, len(payload)) + payload


class NatNetDecoder:
    """Finds rigid bodies and markers in the packets of one server.

    Attributes:
        version: version of the stream, major and minor; None = not yet reported by the server.
        server: the program that sends, "" = not reported.
        refused: number of packets that were no NatNet, or of an unsupported version.
    """

    def __init__(self) -> None:
        self.version: tuple[int, int] | None = None
        self.server = ""
        self.refused = 0
        self._model: NatNetModel | None = None
        self._unnamed = 0

    @property
    def knows_names(self) -> bool:
        """Whether the server has described its assets, and some have markers."""
        return self._model is not None and bool(self._model.assets)

    def feed(self, data: bytes) -> PacketContent:
        """Return the content of a packet; empty if it is refused."""
        try:
            if len(data) > LONGEST:
                raise CutError
            packet = Packet(data)
            kind, size = packet.numbers("HH")
            if size > len(data) - 4:
                raise CutError
            if kind == SERVER_INFO:
                self._read_server(packet)
            elif kind == MODEL and self.version is not None:
                self._model = read_model(packet, self.version)
            elif kind == FRAME and self.version is not None:
                found = self._read_frame(packet, self.version)
                self._unnamed += not self.knows_names
                return found if self.knows_names or self._unnamed > _UNNAMED else PacketContent()
        except CutError:
            self.refused += 1
        return PacketContent()

    def _read_server(self, packet: Packet) -> None:
        name = packet.text()
        packet.skip(256 - len(name.encode()) - 1 if len(name.encode()) < 256 else 0)
        packet.numbers("4B")  # version of the program
        major, minor, _, _ = packet.numbers("4B")
        if major not in (3, 4):
            raise CutError
        self.server, self.version = name[:LONGEST_NAME], (int(major), int(minor))

    def _read_frame(self, packet: Packet, version: tuple[int, int]) -> PacketContent:
        sized = version >= SIZED
        model = self._model or NatNetModel()
        packet.numbers("i")  # number of the frame
        sets = packet.count()
        if sized:
            packet.skip(packet.whole())
        else:
            for _ in range(sets):
                packet.text()
                packet.skip(12 * packet.count())
        unlabelled, part = _section(packet, sized)
        loose = [one for one in (part.numbers("3f") for _ in range(unlabelled)) if is_place(one)]
        count, part = _section(packet, sized)
        if count > MOST_BODIES:
            raise CutError
        bodies = [_rigid_body(part, model) for _ in range(count)]
        if sized:
            for _ in ("skeletons", "assets"):
                packet.count()
                packet.skip(packet.whole())
        else:
            for _ in range(packet.count()):  # skeletons
                packet.skip(4)
                packet.skip(_BODY_BYTES * packet.count())
        count, part = _section(packet, sized)
        return PacketContent(bodies, _markers(part, count, model, loose))


def _section(packet: Packet, sized: bool) -> tuple[int, Packet]:
    """Return the number of parts of a section, and the packet from which they are read."""
    count = packet.count()
    return count, packet.part(packet.whole()) if sized else packet


def _rigid_body(packet: Packet, model: NatNetModel) -> BodyReading:
    number, *pose = packet.numbers("i7f")
    _, told = packet.numbers("fh")  # mean error of its markers [m]; bit 0: it was tracked
    tracked = bool(int(told) & 1)
    if not is_pose(pose):
        tracked, pose = False, [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0]
    x, y, z, qx, qy, qz, qw = pose
    return BodyReading(
        model.bodies.get(int(number), f"body {int(number)}"), (x, y, z), (qx, qy, qz, qw), tracked
    )


def _markers(
    packet: Packet, count: int, model: NatNetModel, unlabelled: list[tuple[float, ...]]
) -> MarkersReading | None:
    """Return the visible markers of a frame; None if it has none. Motive repeats the unlabelled ones among the
    labelled ones; other programs send them only in their own section."""
    named: dict[str, Place] = {}
    loose: list[tuple[float, ...]] = []
    for _ in range(count):
        number, x, y, z, _, told, _ = packet.numbers("i4fhf")  # size, flags, residual
        asset, member = int(number) >> 16, int(number) & 0xFFFF
        if int(told) & _OCCLUDED or not is_place((x, y, z)):
            continue
        name = model.marker(asset, member)
        if asset <= 0 or int(told) & _UNLABELLED or name in named or len(named) >= MOST_MARKERS:
            loose.append((x, y, z))
        else:
            named[name] = _rounded((x, y, z))
    places = tuple(_rounded(one) for one in (loose or unlabelled)[:MOST_MARKERS])
    return MarkersReading(tuple(named), tuple(named.values()), places) if named or places else None


def _rounded(place: tuple[float, ...]) -> Place:
    """Return a place rounded to a hundredth of a millimetre: the accuracy of single precision, in half the text."""
    x, y, z = place
    return round(x, 5), round(y, 5), round(z, 5)


def is_place(numbers: tuple[float, ...]) -> bool:
    """Whether x, y, z [m] can be a place: finite, near."""
    return all(abs(one) <= FARTHEST_M for one in numbers)


def is_pose(numbers: list[float]) -> bool:
    """Whether x, y, z [m] and a quaternion can be a pose: finite, near, of length 1."""
    if len(numbers) != 7 or not all(math.isfinite(one) for one in numbers):
        return False
    return max(map(abs, numbers[:3])) <= FARTHEST_M and abs(math.hypot(*numbers[3:]) - 1.0) < 0.1
