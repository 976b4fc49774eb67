"""Phones as cameras: the operator's invitation as a QR code, and what the phone gets for it."""

import base64
from pathlib import Path
from typing import Annotated

from fastapi import APIRouter, Request
from fastapi.responses import Response
from pydantic import BaseModel, ConfigDict, Field

from studio.api.access import Access
from studio.api.access.fingerprint import fingerprint
from studio.api.access.invitations import INVITATION_S
from studio.api.access.tokens import FAILURES_OVER_S
from studio.api.address import address_for_others
from studio.api.cameras.qr import qr_picture
from studio.api.errors import RESPONSES, ErrorBody, error_response
from studio.engine.base.sentences import say
from studio.live import LiveStage

PHONE_PAGE = "/phone"
PHONE_API = "/api/v1/phones"


class PhoneInvitation(BaseModel):
    """How a phone becomes a camera."""

    url: str = Field(description="what the phone opens; where tokens are asked for it is good once")
    qr: str = Field(description="the same as a QR code: SVG in base64")
    local: bool = Field(description="this server answers on its own machine only: no phone reaches it")
    secure: bool = Field(description="encrypted; without that, browsers of other machines give no camera")
    minutes: int = Field(description="how long the address is good; 0: no token is asked for")
    fingerprint: str = Field(description="SHA-256 of the server's certificate; empty: it has none")


class PhoneRequest(BaseModel):
    """What a phone shows to be let in."""

    model_config = ConfigDict(extra="forbid")

    invitation: Annotated[str, Field(max_length=200)] = ""
    name: Annotated[
        str,
        Field(pattern=r"^([A-Za-z0-9][A-Za-z0-9_.-]{0,62})?$", description="by which it was known before"),
    ] = ""


class PhoneAccess(BaseModel):
    """What a phone says in its hello."""

    name: str = Field(description="a free camera name, or the given one")
    token: str = Field(description="for cameras, to be kept; empty where none is asked for")


def phones_router(access: Access, stage: LiveStage, certificate: Path | None) -> APIRouter:
    """Return the routes of phones.

    Args:
        access: access control.
        stage: has the cameras whose names are taken.
        certificate: of the server; None = it has none.
    """
    router = APIRouter(tags=["cameras"], responses=RESPONSES)
    given: set[str] = set()

    @router.post(f"{PHONE_API}/invite", status_code=201)
    def invite_phone(request: Request) -> PhoneInvitation:
        """Make an address that makes one phone a camera, within ten minutes."""
        root, local = address_for_others(request)
        url = root + PHONE_PAGE + (f"#{access.phone_invitations.make()}" if access.required else "")
        return PhoneInvitation(
            url=url,
            qr=base64.b64encode(bytes(qr_picture(url).body)).decode("ascii"),
            local=local,
            secure=request.url.scheme == "https",
            minutes=int(INVITATION_S // 60) if access.required else 0,
            fingerprint="" if certificate is None else fingerprint(certificate),
        )

    @router.post(
        PHONE_API,
        status_code=201,
        response_model=PhoneAccess,
        responses={401: {"model": ErrorBody}, 429: {"model": ErrorBody}},
    )
    def admit_phone(body: PhoneRequest, request: Request) -> PhoneAccess | Response:
        """Let a phone in as a camera: a name that no other camera has and, for its invitation, a token."""
        address = request.client.host if request.client else ""
        name = body.name or _free_name(given | set(stage.status().cameras))
        token = ""
        if access.required:
            if not access.may_try(address):
                text = say(
                    "phone.too_many",
                    "too many wrong codes; wait {seconds:.0f} s and try again",
                    seconds=FAILURES_OVER_S,
                )
                return error_response(429, "too_many", text)
            if not access.phone_invitations.use(body.invitation):
                access.count_failure(address)
                text = say(
                    "phone.used",
                    "this code was used already, or is too old; show a new one in the studio under Add a camera",
                )
                return error_response(401, "wrong_token", text)
            token = access.add_camera(name)[1]
        given.add(name)
        return PhoneAccess(name=name, token=token)

    return router


def _free_name(taken: set[str]) -> str:
    return next(name for number in range(1, len(taken) + 2) if (name := f"phone_{number}") not in taken)
