"""Threads that receive triggers: UDP sockets, and a MIDI device's file."""

import logging
import socket
import threading
import time
from collections.abc import Callable

from msgspec import Struct

from studio.engine.base.addresses import not_listening
from studio.engine.base.sentences import say
from studio.timecode.pipe import WAIT_S
from studio.timecode.sources import read_midi

_MOST_BYTES = 65_536
_RETRY_S = 1.0
_log = logging.getLogger(__name__)

Hear = Callable[[bytes, str], tuple[str, str, bytes]]
"""Takes a packet and its sender; returns its content in words, why it did nothing, and the answer."""


class TriggerStatus(Struct, frozen=True):
    """State of a trigger: whether it is on, where it listens or sends to, and its packets.

    Attributes:
        heard, refused: number of requests that did something, and of packets that did nothing.
        last: the last packet in words, with its sender, "" = none; last_s: its age [s].
        answer: why the last packet did nothing, "" = it had an effect.
        problem: why it cannot listen or send, "" = no problem.
    """

    on: bool = False
    address: str = ""
    heard: int = 0
    refused: int = 0
    last: str = ""
    last_s: float | None = None
    answer: str = ""
    problem: str = ""


class Heard:
    """Counts the packets of a trigger."""

    def __init__(self, address: str) -> None:
        self.address, self.problem = address, ""
        self._heard = self._refused = 0
        self._last, self._answer, self._at_s = "", "", 0.0

    def add(self, what: str, why: str) -> None:
        """Add a packet, and why it did nothing ("" = it had an effect)."""
        self._heard += not why
        self._refused += bool(why)
        self._last, self._answer, self._at_s = what, why, time.monotonic()

    def status(self) -> TriggerStatus:
        """Return the state so far."""
        ago = round(time.monotonic() - self._at_s, 1) if self._last else None
        return TriggerStatus(
            True, self.address, self._heard, self._refused, self._last, ago, self._answer, self.problem
        )


class UdpListener:
    """Receives packets at an address of this machine, on its own thread, until `close`."""

    def __init__(self, host: str, port: int, hear: Hear) -> None:
        self._address = host, port
        self._hear = hear
        self.heard = Heard(f"{host}:{port}")
        self._stopping = threading.Event()
        channel = self._bound()  # packets are received from now on
        self._thread = threading.Thread(target=self._run, args=(channel,), name="trigger", daemon=True)
        self._thread.start()

    def _bound(self) -> socket.socket | None:
        """Return a socket at the address; None if it cannot be opened, with the reason as the problem."""
        channel = None
        try:
            channel = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
            channel.bind(self._address)
            channel.settimeout(WAIT_S)
        except OSError as error:
            self.heard.problem = not_listening(self.heard.address, error)
            if channel is not None:
                channel.close()
            return None
        self.heard.problem = ""
        return channel

    def _run(self, channel: socket.socket | None) -> None:
        while not self._stopping.is_set():
            if channel is None:
                self._stopping.wait(_RETRY_S)
                channel = self._bound()
                continue
            with channel:
                try:
                    self._receive(channel)
                except OSError as error:
                    _log.info("%s: %s", self.heard.address, error)
            channel = None
        if channel is not None:
            channel.close()

    def _receive(self, channel: socket.socket) -> None:
        while not self._stopping.is_set():
            try:
                data, (host, port) = channel.recvfrom(_MOST_BYTES)
            except TimeoutError:
                continue
            except ConnectionError:
                continue  # an answer was refused (Windows)
            try:
                what, why, answer = self._hear(data, host)
                self.heard.add(f"{what} ({host})", why)
                if answer:
                    channel.sendto(answer, (host, port))
            except OSError as error:
                _log.info("no answer to %s: %s", host, error)
            except Exception:  # boundary of the thread: one packet must not end it
                _log.exception("a trigger failed")
                self.heard.add(
                    f"? ({host})", say("trigger.failed", "the packet failed; the server's log has why")
                )

    def close(self) -> None:
        """Stop listening."""
        self._stopping.set()
        if self._thread is not threading.current_thread():
            self._thread.join(timeout=5.0)


class MidiListener:
    """Receives the bytes of a MIDI device, on its own thread, until `close`."""

    def __init__(self, device: str, hear: Callable[[bytes], list[str]]) -> None:
        self._device = device
        self._hear = hear
        self.heard = Heard(device)
        self._stopping = threading.Event()
        self._thread = threading.Thread(target=self._run, name="trigger", daemon=True)
        self._thread.start()

    def _run(self) -> None:
        while not self._stopping.is_set():
            try:
                read_midi(self._device, self._stopping, self._take)
            except (OSError, ValueError) as error:
                self.heard.problem = not_listening(self._device, error)
                self._stopping.wait(_RETRY_S)

    def _take(self, data: bytes) -> None:
        self.heard.problem = ""
        for why in self._hear(data):
            self.heard.add("note", why)

    def close(self) -> None:
        """Stop listening."""
        self._stopping.set()
        self._thread.join(timeout=5.0)
