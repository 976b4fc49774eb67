"""Invitation of a phone as remote control: an address that it can reach, as a QR code that signs it in."""

import base64
import ipaddress
import socket
from urllib.parse import quote

from fastapi import APIRouter, Request
from pydantic import BaseModel, Field

from studio.api.access import Access
from studio.api.access.guard import SIGN_IN_PATH
from studio.api.access.tokens import INVITATION_S
from studio.api.cameras.qr import qr_picture
from studio.api.errors import RESPONSES

REMOTE_PATH = "/remote"
_ELSEWHERE = ("192.0.2.1", 9)
"""An address of no machine (RFC 5737). A socket to it sends nothing, but has this machine's address."""


class RemoteInvitation(BaseModel):
    """Instructions for a phone as remote control."""

    url: str = Field(description="what the phone opens; where tokens are asked for it signs in once")
    qr: str = Field(description="the same as a QR code: SVG in base64")
    local: bool = Field(description="this server answers on its own machine only: no phone reaches it")
    minutes: int = Field(description="how long the address signs in; 0: nobody is asked to")


def remote_router(access: Access) -> APIRouter:
    """Return the route of the remote control."""
    router = APIRouter(prefix="/api/v1", tags=["access"], responses=RESPONSES)

    @router.post("/remote", status_code=201)
    def invite(request: Request) -> RemoteInvitation:
        """Make an address that opens the remote control on a phone; it signs in one browser, within ten minutes."""
        root = root_address(request, for_others=access.required)
        if access.required:
            url = f"{root}{SIGN_IN_PATH}?next={quote(REMOTE_PATH)}#{access.invite()}"
        else:
            url = root + REMOTE_PATH
        picture = base64.b64encode(bytes(qr_picture(url).body)).decode("ascii")
        minutes = int(INVITATION_S // 60) if access.required else 0
        return RemoteInvitation(url=url, qr=picture, local=not access.required, minutes=minutes)

    return router


def root_address(request: Request, *, for_others: bool) -> str:
    """Return the studio's address as in the browser; `for_others`: as other machines reach it."""
    host = request.url.hostname or ""
    if for_others and _is_loopback(host):
        host = own_address() or host
    return (
        f"{request.url.scheme}://{f'[{host}]' if ':' in host else host}:{request.url.port or _usual(request)}"
    )


def own_url(request: Request) -> str:
    """Return the address at which this server was reached, for programs on its own machine."""
    host, port = request.scope["server"]
    return f"{request.url.scheme}://{f'[{host}]' if ':' in host else host}:{port}"


def own_address() -> str:
    """Return this machine's address in its network; may be empty."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as asked:
        try:
            asked.connect(_ELSEWHERE)
            return str(asked.getsockname()[0])
        except OSError:
            return ""


def _is_loopback(host: str) -> bool:
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return host == "localhost"


def _usual(request: Request) -> int:
    return 443 if request.url.scheme == "https" else 80
