"""Datagrams to one address."""

import socket
from typing import Any

from studio.engine.base.sentences import say


def cannot_send(host: str, error: OSError) -> str:
    """Return the message about a datagram that could not be sent."""
    return say(
        "output.cannot_send", "cannot send to {host}: {error}", host=host, error=error.strerror or str(error)
    )


class Channel:
    """Sends datagrams to a host and port; the name is resolved when the first one is sent."""

    def __init__(self, host: str, port: int) -> None:
        self._host, self._port = host, port
        self._address: Any = None
        self._socket: socket.socket | None = None

    def send(self, datagram: bytes) -> None:
        """Send a datagram.

        Raises:
            OSError: an unknown name, no route, a refused port.
        """
        if self._socket is None:
            family, kind, _, _, self._address = socket.getaddrinfo(
                self._host, self._port, type=socket.SOCK_DGRAM
            )[0]
            self._socket = socket.socket(family, kind)
        self._socket.sendto(datagram, self._address)

    def close(self) -> None:
        """Close the socket."""
        if self._socket is not None:
            self._socket.close()
            self._socket = None
