"""A small NatNet server for tests, from OptiTrack's public documentation of the packets.

The client natnet 0.3, which was not written here, reads what it makes.
"""

import socket
import struct
import threading
from collections.abc import Sequence

Body = tuple[int, str, tuple[float, float, float], tuple[float, float, float, float], bool]
"""Number, name, place [m], rotation x y z w, whether it is tracked."""


def message(kind: int, payload: bytes) -> bytes:
    return struct.pack("<HH", kind, len(payload)) + payload


def server_info(version: tuple[int, int]) -> bytes:
    return message(1, b"Motive".ljust(256, b"\0") + bytes([3, 1, 0, 0]) + bytes([*version, 0, 0]))


def _sized(version: tuple[int, int], count: int, content: bytes) -> bytes:
    size = struct.pack("<i", len(content)) if version >= (4, 1) else b""
    return struct.pack("<i", count) + size + content


def model(version: tuple[int, int], bodies: Sequence[Body]) -> bytes:
    """A marker set, then the rigid bodies with three markers each."""
    parts = [(0, b"all\0" + struct.pack("<i", 1) + b"m\0")]
    for number, name, *_ in bodies:
        one = name.encode() + b"\0" + struct.pack("<ii3f", number, -1, 0, 0, 0)
        one += struct.pack("<4f", 0, 0, 0, 1) if version >= (4, 2) else b""
        one += struct.pack("<i9f3i", 3, *range(9), 0, 0, 0)
        one += b"a\0b\0c\0" if version >= (4, 0) else b""
        parts.append((1, one))
    content = struct.pack("<i", len(parts))
    for kind, one in parts:
        content += struct.pack("<i", kind) + (struct.pack("<i", len(one)) if version >= (4, 1) else b"") + one
    return message(5, content)


def frame(version: tuple[int, int], number: int, bodies: Sequence[Body]) -> bytes:
    """A frame with a marker set, two unlabelled markers, and the rigid bodies; nothing else."""
    content = struct.pack("<i", number)
    content += _sized(version, 1, b"all\0" + struct.pack("<i3f", 1, 1, 2, 3))
    content += _sized(version, 2, struct.pack("<6f", *range(6)))
    poses = [struct.pack("<i7ffh", one[0], *one[2], *one[3], 0.0005, int(one[4])) for one in bodies]
    content += _sized(version, len(poses), b"".join(poses))
    for _ in range(5 if version >= (4, 1) else 4):  # skeletons, assets, labelled markers, plates, devices
        content += _sized(version, 0, b"")
    content += struct.pack("<iid3q", 0, 0, 1.5, 1, 2, 3) + (b"\0" * 8 if version >= (4, 1) else b"")
    return message(7, content + struct.pack("<hi", 0, 0))


class NatNetServer:
    """Answers one client, and sends it what `send` is given."""

    def __init__(self, version: tuple[int, int], bodies: Sequence[Body]) -> None:
        self._version, self._bodies = version, bodies
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
                self._socket.sendto(model(self._version, self._bodies), client)
                self.asked_names.set()

    def send(self, number: int, bodies: Sequence[Body]) -> None:
        if self.client is not None:
            self._socket.sendto(frame(self._version, number, bodies), self.client)

    def send_raw(self, data: bytes) -> None:
        if self.client is not None:
            self._socket.sendto(data, self.client)

    def close(self) -> None:
        self._socket.close()
