"""The WebSocket stream of Capture Studio, read with nothing but Python: for the programs beside this file.

Frames are in the stage frame: metres, z up, as Blender has it; rotations are the identity in the T-pose.
Source: RFC 6455, and docs/streaming.md. To see what comes, without any other program:

    python examples/receivers/stream.py [ws://127.0.0.1:8000/api/v1/stream]
"""

import base64
import json
import os
import socket
import struct
import sys
from collections.abc import Iterator
from typing import NamedTuple
from urllib.parse import urlsplit

URL = "ws://127.0.0.1:8000/api/v1/stream"
_MOST_BYTES = 1 << 20
_TEXT, _CLOSE, _PING, _PONG = 1, 8, 9, 10


class Skeleton(NamedTuple):
    """The joints' names, and the number of each one's parent, -1 = none."""

    names: list[str]
    parents: list[int]


class Frame(NamedTuple):
    """A frame of a performer: time [s], per joint position [m] and rotation wxyz, timecode or ""."""

    time_s: float
    performer: str
    positions_m: list[list[float]]
    rotations_wxyz: list[list[float]]
    timecode: str


def read(text: str) -> Skeleton | list[Frame]:
    """Return what a message has: the skeleton, which comes first, or a frame of each performer.

    Raises:
        ValueError, KeyError: it is none of both.
    """
    value = json.loads(text)
    if value["type"] == "skeleton":
        return Skeleton(value["joint_names"], value["parents"])
    return [
        Frame(
            value["time_s"],
            one.get("performer", ""),
            one["positions_m"],
            one["rotations_wxyz"],
            value.get("timecode", ""),
        )
        for one in (value, *value.get("others", ()))
    ]


class Stream:
    """A connection to a studio. `token` is the operator's, where the studio asks for one.

    Raises:
        OSError: nobody answers there. ConnectionError: the studio refused, or the connection ended.
    """

    def __init__(self, url: str = URL, token: str = "", timeout_s: float = 10.0) -> None:
        parts = urlsplit(url)
        self._socket = socket.create_connection((parts.hostname, parts.port or 80), timeout_s)
        path = (parts.path or "/") + (f"?{parts.query}" if parts.query else "")
        key = base64.b64encode(os.urandom(16)).decode()
        lines = [f"GET {path} HTTP/1.1", f"Host: {parts.netloc}", "Upgrade: websocket", "Connection: Upgrade",
                 f"Sec-WebSocket-Key: {key}", "Sec-WebSocket-Version: 13"]  # fmt: skip
        lines += [f"Authorization: Bearer {token}"] if token else []
        self._socket.sendall(("\r\n".join(lines) + "\r\n\r\n").encode())
        self._file = self._socket.makefile("rb")
        answer = self._file.readline(1000).decode("latin-1").strip()
        while self._file.readline(10_000) not in (b"\r\n", b""):
            pass
        if " 101 " not in answer + " ":
            raise ConnectionError(f"{url}: {answer or 'no answer'}")

    def texts(self) -> Iterator[str]:
        """Yield the messages as they come, until the studio ends the connection."""
        whole = b""
        while True:
            kind, last, data = self._part()
            if kind == _CLOSE:
                self.close()
                return
            if kind == _PING:
                self._send(_PONG, data)
            elif kind in (0, _TEXT):
                whole += data
                if len(whole) > _MOST_BYTES:
                    raise ConnectionError("a message is too long")
                if last:
                    yield whole.decode("utf-8")
                    whole = b""

    def _part(self) -> tuple[int, bool, bytes]:
        head, size = self._exactly(2)
        size &= 127
        if size == 126:
            (size,) = struct.unpack(">H", self._exactly(2))
        elif size == 127:
            (size,) = struct.unpack(">Q", self._exactly(8))
        if size > _MOST_BYTES:
            raise ConnectionError("a message is too long")
        return head & 15, bool(head & 128), self._exactly(size)

    def _exactly(self, size: int) -> bytes:
        data = self._file.read(size)
        if len(data) < size:
            raise ConnectionError("the studio ended the connection")
        return data

    def _send(self, kind: int, data: bytes) -> None:
        mask = os.urandom(4)
        masked = bytes(byte ^ mask[k % 4] for k, byte in enumerate(data[:125]))
        self._socket.sendall(bytes([128 | kind, 128 | len(masked)]) + mask + masked)

    def close(self) -> None:
        """End the connection."""
        try:
            self._send(_CLOSE, b"")
        except OSError:
            pass
        self._file.close()
        self._socket.close()


def main(url: str) -> None:
    for text in Stream(url).texts():
        message = read(text)
        for frame in message if isinstance(message, list) else ():
            hips = [round(value, 3) for value in frame.positions_m[0]]
            print(f"{frame.time_s:8.2f} s {frame.timecode} {frame.performer} hips {hips} m")


if __name__ == "__main__":
    main(sys.argv[1] if len(sys.argv) > 1 else URL)
