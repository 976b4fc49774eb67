"""A small NatNet server for tests, from OptiTrack's public documentation of the packets.

The client natnet, which was not written here, reads what it makes (`test_other_client.py`).
"""

import socket
import struct
import threading
from collections.abc import Sequence

Marker = tuple[int, int, tuple[float, float, float], int]
"""Number of its asset, its own from 1, place [m], flags: 1 = occluded, 16 = unlabelled."""

Body = tuple[int, str, tuple[float, float, float], tuple[float, float, float, float], bool]
"""Number, name, place [m], rotation x y z w, whether it is tracked."""


def message(kind: int, payload: bytes) -> bytes:
    return struct.pack("<HH", kind, len(payload)) + payload


def server_info(version: tuple[int, int]) -> bytes:
    return message(1, b"Motive".ljust(256, b"\0") + bytes([3, 1, 0, 0]) + bytes([*version, 0, 0]))


def _sized(version: tuple[int, int], count: int, content: bytes) -> bytes:
    size = struct.pack("<i", len(content)) if version >= (4, 1) else b""
    return struct.pack("<i", count) + size + content


PERFORMER, PERFORMER_NUMBER = "Anna", 3
"""A skeleton, whose markers are named by the marker set of its name."""


def model(
    version: tuple[int, int], bodies: Sequence[Body], labels: Sequence[str] = ("LKNE", "RKNE")
) -> bytes:
    """Marker sets, the rigid bodies with three markers each, a skeleton, and from 4.1 on a trained marker set."""
    texts = "".join(f"{label}\0" for label in labels).encode()
    parts = [(0, b"all\0" + struct.pack("<i", 1) + b"m\0")]
    parts.append((0, PERFORMER.encode() + b"\0" + struct.pack("<i", len(labels)) + texts))
    one = b""
    for number, name, *_ in bodies:
        one = name.encode() + b"\0" + struct.pack("<ii3f", number, -1, 0, 0, 0)
        one += struct.pack("<4f", 0, 0, 0, 1) if version >= (4, 2) else b""
        one += struct.pack("<i9f3i", 3, *range(9), 0, 0, 0)
        one += b"a\0b\0c\0" if version >= (4, 0) else b""
        parts.append((1, one))
    parts.append((2, PERFORMER.encode() + b"\0" + struct.pack("<ii", PERFORMER_NUMBER, 1) + one))
    if version >= (4, 1):
        trained = b"Cape\0" + struct.pack("<iii", 1, 5, 0) + struct.pack("<i", 1)
        parts.append((6, trained + b"Cape_Hem\0" + struct.pack("<i4fh", 1, 0, 0, 0, 0.01, 0)))
    content = struct.pack("<i", len(parts))
    for kind, one in parts:
        content += struct.pack("<i", kind) + (struct.pack("<i", len(one)) if version >= (4, 1) else b"") + one
    return message(5, content)


def frame(
    version: tuple[int, int], number: int, bodies: Sequence[Body], markers: Sequence[Marker] = ()
) -> bytes:
    """A frame with a marker set, two unlabelled markers, the rigid bodies, a skeleton, and labelled markers."""
    content = struct.pack("<i", number)
    content += _sized(version, 1, b"all\0" + struct.pack("<i3f", 1, 1, 2, 3))
    content += _sized(version, 2, struct.pack("<6f", *range(6)))
    poses = [struct.pack("<i7ffh", one[0], *one[2], *one[3], 0.0005, int(one[4])) for one in bodies]
    content += _sized(version, len(poses), b"".join(poses))
    content += _sized(version, 1, struct.pack("<ii", PERFORMER_NUMBER, 1) + poses[0])
    content += _sized(version, 0, b"") if version >= (4, 1) else b""  # assets
    labelled = [
        struct.pack("<i4fhf", (asset << 16) + own, *place, 0.014, flags, 0.0003)
        for asset, own, place, flags in markers
    ]
    content += _sized(version, len(labelled), b"".join(labelled))
    content += _sized(version, 0, b"") * 2  # plates, devices
    content += struct.pack("<iid3q", 0, 0, 1.5, 1, 2, 3) + (b"\0" * 8 if version >= (4, 1) else b"")
    return message(7, content + struct.pack("<hi", 0, 0))


class NatNetServer:
    """Answers one client, and sends it what `send` is given."""

    def __init__(
        self, version: tuple[int, int], bodies: Sequence[Body], labels: Sequence[str] = ("LKNE", "RKNE")
    ) -> None:
        self._version, self._model = version, model(version, bodies, labels)
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.bind(("127.0.0.1", 0))
        self.port = self._socket.getsockname()[1]
        self.client: tuple[str, int] | None = None
        self.asked_names = threading.Event()
        threading.Thread(target=self._run, daemon=True).start()

    def _run(self) -> None:
        while True:
            try:
                data, client = self._socket.recvfrom(2048)
            except OSError:
                return
            kind = struct.unpack_from("<H", data)[0]
            self.client = client
            if kind == 0:
                self._socket.sendto(server_info(self._version), client)
            elif kind == 4:
                self._socket.sendto(self._model, client)
                self.asked_names.set()

    def send(self, number: int, bodies: Sequence[Body], markers: Sequence[Marker] = ()) -> None:
        if self.client is not None:
            self._socket.sendto(frame(self._version, number, bodies, markers), self.client)

    def send_raw(self, data: bytes) -> None:
        if self.client is not None:
            self._socket.sendto(data, self.client)

    def close(self) -> None:
        self._socket.close()
