"""A camera client for tests, in a few lines: its own clock, the protocol over a real WebSocket."""

import time
from collections.abc import Callable

from websockets.sync.client import ClientConnection

from studio import wire
from tests.live.performer import frame, hello
from tests.patient import connect

WAIT_S = 120.0


def wait_until(happened: Callable[[], bool], what: str) -> None:
    """Return once it has happened; fail after a time that only a broken program needs."""
    end = time.monotonic() + WAIT_S
    while not happened():
        assert time.monotonic() < end, f"waited {WAIT_S:.0f} s in vain until {what}"
        time.sleep(0.01)


class Camera:
    """Camera number `index` of the simulated stage. Its clock is `index` seconds ahead of the server's."""

    def __init__(self, url: str, index: int, name: str | None = None) -> None:
        self.index = index
        self.name = name or f"camera_{index}"
        self.socket: ClientConnection = connect(url, max_size=None, compression=None)
        self.sequence = 0
        self.received: list[wire.Message] = []

    def __enter__(self) -> "Camera":
        return self

    def __exit__(self, *_: object) -> None:
        self.socket.close()

    def clock_ns(self) -> int:
        return time.monotonic_ns() + self.index * 1_000_000_000

    def send(self, message: wire.Message) -> None:
        self.socket.send(wire.encode(message))

    def receive(self) -> wire.Message:
        """The next message of the server."""
        data = self.socket.recv(timeout=WAIT_S)
        assert isinstance(data, bytes)
        self.received.append(wire.decode(data))
        return self.received[-1]

    def receive_kind(self, kind: type) -> wire.Message:
        """The next message of a kind; others go to `received`."""
        while not isinstance(message := self.receive(), kind):
            pass
        return message

    def greet(self, **changes: object) -> wire.Message:
        """Say hello and return the answer."""
        self.send(hello(self.name, **changes))
        return self.receive()

    def exchange_clocks(self) -> None:
        """One exchange of clocks, reported back."""
        self.send(wire.ClockRequest(self.clock_ns()))
        reply = self.receive_kind(wire.ClockReply)
        self.send(
            wire.ClockSample(
                reply.client_send_ns, reply.server_receive_ns, reply.server_send_ns, self.clock_ns()
            )
        )

    def send_frame(self) -> None:
        """The next frame: the performer moves by a thirtieth of a second, whatever the clock says."""
        self.sequence += 1
        self.send(frame(self.index, self.sequence, self.clock_ns(), self.sequence / 30.0))


def send_frames(cameras: list[Camera], count: int) -> None:
    """Have the cameras send so many frames each, in turn, a few milliseconds apart."""
    for _ in range(count):
        for camera in cameras:
            camera.send_frame()
        time.sleep(0.01)
