"""Threads that receive rigid bodies and markers: NatNet from a server, and trackers over OSC."""

import logging
import selectors
import socket
import struct
import threading
import time
from collections.abc import Callable
from typing import Protocol

from msgspec import Struct

from studio.engine.base.addresses import not_listening
from studio.engine.rigid_bodies.reading import BodyAxes
from studio.rigid_bodies import natnet
from studio.rigid_bodies.content import PacketContent
from studio.rigid_bodies.natnet import NatNetDecoder
from studio.rigid_bodies.settings import RigidSettings
from studio.rigid_bodies.trackers import TrackerDecoder

WAIT_S, _RETRY_S, _ASK_S, _NAMES_S = 0.2, 1.0, 1.0, 5.0
MOST_PER_S = 1000
"""Maximum number of packets per second of one source; more are dropped, so that no sender can fill a take."""

_log = logging.getLogger(__name__)

Put = Callable[[BodyAxes, PacketContent], object]
"""Takes the axes of a packet, and its content."""


class RigidSourceStatus(Struct, frozen=True):
    """State of a system of rigid bodies: whether it is on, its address, and its packets.

    Attributes:
        packets: number with rigid bodies or markers; refused: number of unreadable ones; dropped: over the limit.
        server: the program that sends, if it reports it, "" = unknown.
        problem: why nothing is received, "" = no problem.
    """

    on: bool = False
    address: str = ""
    server: str = ""
    packets: int = 0
    refused: int = 0
    dropped: int = 0
    problem: str = ""


class _Source(Protocol):
    address: str

    @property
    def server(self) -> str: ...

    @property
    def refused(self) -> int: ...

    def open(self) -> list[socket.socket]: ...

    def idle(self, channels: list[socket.socket], now_s: float) -> None: ...

    def read(self, data: bytes, sender: str) -> tuple[BodyAxes, PacketContent]: ...


class OscSource:
    """Trackers over OSC at an address of this machine."""

    server = ""

    def __init__(self, settings: RigidSettings) -> None:
        self._at = settings.host, settings.osc_port
        self.address = f"{settings.host}:{settings.osc_port}"
        self._decoder = TrackerDecoder()

    @property
    def refused(self) -> int:
        return self._decoder.refused

    def open(self) -> list[socket.socket]:
        """Return a socket at the address.

        Raises:
            OSError: it cannot be opened.
        """
        return [_bound(self._at)]

    def idle(self, channels: list[socket.socket], now_s: float) -> None:
        """Do nothing: trackers send without a request."""

    def read(self, data: bytes, sender: str) -> tuple[BodyAxes, PacketContent]:
        """Return the trackers of a packet."""
        return "unity", PacketContent(self._decoder.feed(data))


class NatNetSource:
    """NatNet of a server. Packets from other machines are refused."""

    def __init__(self, settings: RigidSettings) -> None:
        self._settings = settings
        self.address = f"{settings.natnet_server}:{settings.natnet_port}"
        self._axes: BodyAxes = "y_up" if settings.natnet_up == "y" else "z_up"
        self._decoder = NatNetDecoder()
        self._strangers = 0
        self._host = ""
        self._asked_s = self._named_s = -1e9

    @property
    def server(self) -> str:
        major, minor = self._decoder.version or (0, 0)
        return f"{self._decoder.server} (NatNet {major}.{minor})" if self._decoder.version else ""

    @property
    def refused(self) -> int:
        return self._decoder.refused + self._strangers

    def open(self) -> list[socket.socket]:
        """Return a socket for the server's answers, and one for the multicast group, if any.

        Raises:
            OSError: the name is unknown, or a socket cannot be opened.
        """
        self._host = socket.gethostbyname(self._settings.natnet_server)
        self._asked_s = self._named_s = -1e9
        local = "127.0.0.1" if self._host.startswith("127.") else ""
        channels = [_bound((local, 0))]
        group = self._settings.natnet_multicast
        if group:
            try:
                channels.append(_bound(("", natnet.DATA_PORT)))
                member = struct.pack("4s4s", socket.inet_aton(group), socket.inet_aton(local or "0.0.0.0"))
                channels[1].setsockopt(socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP, member)
            except OSError:
                for channel in channels:
                    channel.close()
                raise
        return channels

    def idle(self, channels: list[socket.socket], now_s: float) -> None:
        """Send the server a keep-alive, and request its version or its names."""
        if now_s - self._asked_s < _ASK_S:
            return
        self._asked_s = now_s
        to = self._host, self._settings.natnet_port
        channels[0].sendto(natnet.request(natnet.KEEP_ALIVE), to)
        if self._decoder.version is None:
            channels[0].sendto(natnet.request(natnet.CONNECT, "Ping"), to)
        elif not self._decoder.knows_names or now_s - self._named_s > _NAMES_S:
            self._named_s = now_s
            channels[0].sendto(natnet.request(natnet.REQUEST_MODEL), to)

    def read(self, data: bytes, sender: str) -> tuple[BodyAxes, PacketContent]:
        """Return the rigid bodies and markers of a packet."""
        if sender != self._host:
            self._strangers += 1
            return self._axes, PacketContent()
        knew = self._decoder.version is not None
        found = self._decoder.feed(data)
        if not knew and self._decoder.version is not None:
            self._asked_s = -1e9  # request the names at once
        return self._axes, found


def _bound(address: tuple[str, int]) -> socket.socket:
    channel = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    try:
        channel.bind(address)
    except OSError:
        channel.close()
        raise
    channel.setblocking(False)
    return channel


class RigidListener:
    """Receives from a source on its own thread, until `close`."""

    def __init__(self, source: _Source, put: Put) -> None:
        self._source, self._put = source, put
        self._stopping = threading.Event()
        self._packets = self._dropped = 0
        self._second, self._in_second = 0, 0
        self._problem = ""
        self._channels = self._opened()  # packets are received from now on
        self._thread = threading.Thread(target=self._run, name="rigid bodies", daemon=True)
        self._thread.start()

    def status(self) -> RigidSourceStatus:
        """Return the state so far."""
        one = self._source
        return RigidSourceStatus(
            True, one.address, one.server, self._packets, one.refused, self._dropped, self._problem
        )

    def _opened(self) -> list[socket.socket]:
        try:
            channels = self._source.open()
        except OSError as error:
            self._problem = not_listening(self._source.address, error)
            return []
        self._problem = ""
        return channels

    def _run(self) -> None:
        while not self._stopping.is_set():
            if not self._channels:
                self._stopping.wait(_RETRY_S)
                self._channels = self._opened()
                continue
            try:
                self._receive(self._channels)
            except OSError as error:
                self._problem = not_listening(self._source.address, error)
                self._stopping.wait(_RETRY_S)
            except Exception:  # boundary of the thread: one packet must not end it
                _log.exception("rigid bodies failed")
            self._close_channels()
        self._close_channels()

    def _close_channels(self) -> None:
        for channel in self._channels:
            channel.close()
        self._channels = []

    def _receive(self, channels: list[socket.socket]) -> None:
        with selectors.DefaultSelector() as ready:
            for channel in channels:
                ready.register(channel, selectors.EVENT_READ)
            while not self._stopping.is_set():
                self._source.idle(channels, time.monotonic())
                for key, _ in ready.select(WAIT_S):
                    try:
                        data, address = key.fileobj.recvfrom(natnet.LONGEST)  # type: ignore[union-attr]
                    except (BlockingIOError, ConnectionError):
                        continue  # a request was refused (Windows)
                    self._take(data, str(address[0]))

    def _take(self, data: bytes, sender: str) -> None:
        second = int(time.monotonic())
        if second != self._second:
            self._second, self._in_second = second, 0
        self._in_second += 1
        if self._in_second > MOST_PER_S:
            self._dropped += 1
            return
        axes, found = self._source.read(data, sender)
        if found:
            self._packets += 1
            self._put(axes, found)

    def close(self) -> None:
        """Stop listening."""
        self._stopping.set()
        self._thread.join(timeout=5.0)
