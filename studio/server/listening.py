"""The server's socket, and the address under which it is reached."""

import socket
import sys

from studio.api.address import in_url
from studio.engine.base.errors import StudioError
from studio.engine.base.sentences import system_says

LOOPBACK = ("127.0.0.1", "localhost", "::1")


def open_socket(host: str, port: int) -> socket.socket:
    """Return a socket that is bound to the address.

    Raises:
        StudioError: the port is in use, or the address is not this machine's.
    """
    try:
        family, kind, protocol, _, address = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)[0]
        opened = socket.socket(family, kind, protocol)
    except OSError as error:
        raise StudioError(
            "server.not_listening_on",
            "cannot listen on {host}: {error}; choose another --host",
            host=host,
            error=system_says(error),
        ) from error
    if sys.platform != "win32":
        opened.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    try:
        opened.bind(address)
        opened.listen(128)
    except OSError as error:
        opened.close()
        raise StudioError(
            "server.not_listening",
            "cannot listen on {host} port {port}: {error}; stop what uses it or choose another --port",
            host=host,
            port=port,
            error=system_says(error),
        ) from error
    return opened


def url_of(host: str, listening: socket.socket, *, encrypted: bool = False) -> str:
    """Return the server's address."""
    scheme = "https" if encrypted else "http"
    return f"{scheme}://{'localhost' if host == '::1' else in_url(host)}:{listening.getsockname()[1]}"


def for_own_programs(url: str) -> str:
    """Return the server's address as programs on its own machine reach it."""
    return url.replace("0.0.0.0", "127.0.0.1").replace("[::]", "[::1]")
