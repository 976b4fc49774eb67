"""The studio's address: as a browser reached it, as other machines reach it, and for programs on its own machine."""

import ipaddress
import socket
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:  # slow to load, and the start of the server needs none
    from fastapi import Request

_ELSEWHERE = ("192.0.2.1", 9)
"""An address of no machine (RFC 5737). A socket to it sends nothing, but has this machine's address."""


class StudioAddress(NamedTuple):
    """An address without a path, such as http://192.168.1.5:8000, and whether only this machine reaches it."""

    url: str
    local: bool


def address_for_others(request: "Request") -> StudioAddress:
    """Return the studio's address as other machines reach it, or the browser's if they do not.

    A studio that is open to the network may be used at a loopback address on its own machine; its network address is
    returned instead.
    """
    host = request.url.hostname or ""
    is_open = bool(getattr(request.app.state, "open_to_others", False))
    if is_open and is_loopback(host):
        host = own_address() or host
    usual = 443 if request.url.scheme == "https" else 80
    url = f"{request.url.scheme}://{in_url(host)}:{request.url.port or usual}"
    return StudioAddress(url, not is_open or is_loopback(host))


def own_url(request: "Request") -> str:
    """Return the address at which this server was reached, for programs on its own machine."""
    host, port = request.scope["server"]
    return f"{request.url.scheme}://{in_url(host)}:{port}"


def own_address() -> str:
    """Return this machine's address in its network; may be empty."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as asked:
        try:
            asked.connect(_ELSEWHERE)
            return str(asked.getsockname()[0])
        except OSError:
            return ""


def in_url(host: str) -> str:
    """Return a host as written in a URL: IPv6 in brackets."""
    return f"[{host}]" if ":" in host else host


def is_loopback(host: str) -> bool:
    """Whether a host is this machine itself."""
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return host == "localhost"


def is_any(host: str) -> bool:
    """Whether a host stands for all addresses of this machine, as 0.0.0.0 does."""
    try:
        return ipaddress.ip_address(host).is_unspecified
    except ValueError:
        return False
