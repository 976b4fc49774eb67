"""Invitation of a phone as remote control: an address that it can reach, as a QR code that signs it in."""

import base64
from urllib.parse import quote

from fastapi import APIRouter, Request
from pydantic import BaseModel, Field

from studio.api.access import Access
from studio.api.access.guard import SIGN_IN_PATH
from studio.api.access.invitations import INVITATION_S
from studio.api.address import address_for_others
from studio.api.cameras.qr import qr_picture
from studio.api.errors import RESPONSES

REMOTE_PATH = "/remote"


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
        root, local = address_for_others(request)
        if access.required:
            url = f"{root}{SIGN_IN_PATH}?next={quote(REMOTE_PATH)}#{access.invite()}"
        else:
            url = root + REMOTE_PATH
        picture = base64.b64encode(bytes(qr_picture(url).body)).decode("ascii")
        minutes = int(INVITATION_S // 60) if access.required else 0
        return RemoteInvitation(url=url, qr=picture, local=local, minutes=minutes)

    return router
