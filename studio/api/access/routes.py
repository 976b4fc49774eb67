"""Routes of access: signing in and out, the operator's token, and the cameras' tokens."""

from typing import Annotated

from fastapi import APIRouter, Request, Response
from pydantic import BaseModel, ConfigDict, Field

from studio.api.access.guard import COOKIE, SIGN_IN_API, cookie_key
from studio.api.access.tokens import FAILURES_OVER_S, Access, Role
from studio.api.address import address_for_others
from studio.api.errors import RESPONSES, ErrorBody, error_response


class SignIn(BaseModel):
    """The operator's token, as the server printed it at its start, or a viewer's."""

    model_config = ConfigDict(extra="forbid")

    token: Annotated[str, Field(max_length=200, examples=["Zk3v..."])]


class NewCamera(BaseModel):
    """The label of a new camera's token."""

    model_config = ConfigDict(extra="forbid")

    label: Annotated[str, Field(min_length=1, max_length=60, examples=["laptop by the window"])]


class CameraAccess(BaseModel):
    """A camera's token; the token itself is shown only once."""

    id: str
    label: str
    created: str = Field(description="ISO 8601, UTC")


class AccessState(BaseModel):
    """Whether tokens are required, the client's role, and the cameras' tokens, which viewers do not see."""

    required: bool
    role: Role
    cameras: list[CameraAccess]
    address: str = Field(description="the studio's, as other machines reach it, or this browser's")
    local: bool = Field(description="no other machine reaches that address")


class MadeCamera(BaseModel):
    """A new token for cameras; it cannot be shown again."""

    id: str
    token: str
    command: str = Field(description="what to run on the camera's machine")


class OperatorToken(BaseModel):
    """A new operator's token; it cannot be shown again."""

    token: str


class ViewerLink(BaseModel):
    """A new viewer's token and the link that signs in with it; it cannot be shown again."""

    token: str
    link: str


def access_router(access: Access) -> APIRouter:
    """Return the routes of access."""
    router = APIRouter(tags=["access"], responses=RESPONSES)
    wrong = {401: {"model": ErrorBody, "description": "A wrong token."}}
    tired = {429: {"model": ErrorBody, "description": "Too many wrong tokens; wait a minute."}}

    @router.post(SIGN_IN_API, status_code=204, responses={**wrong, **tired})
    def sign_in(body: SignIn, request: Request) -> Response:
        """Sign a browser in; the key comes as a cookie. Programs send the token with every request instead."""
        address = request.client.host if request.client else ""
        if not access.may_try(address):
            return error_response(
                429, "too_many", f"too many wrong tokens; wait {FAILURES_OVER_S:.0f} s and try again"
            )
        key = access.sign_in(body.token.strip(), address)
        if key is None:
            message = "this is not the operator's token, which the server prints at its start, nor a viewer's"
            return error_response(401, "wrong_token", message)
        response = Response(status_code=204)
        response.set_cookie(
            COOKIE, key, httponly=True, samesite="strict", secure=request.url.scheme == "https"
        )
        return response

    @router.post("/api/v1/access/signout", status_code=204)
    def sign_out(request: Request) -> Response:
        """Sign this browser out."""
        access.sign_out(cookie_key(request.headers))
        response = Response(status_code=204)
        response.delete_cookie(COOKIE)
        return response

    @router.get("/api/v1/access")
    def get_access(request: Request) -> AccessState:
        """Whether tokens are required, the client's role, and the cameras' tokens without their secrets."""
        role: Role = request.state.role if hasattr(request.state, "role") else "operator"
        tokens = access.camera_tokens() if role == "operator" else []
        address, local = address_for_others(request)
        return AccessState(
            required=access.required,
            role=role,
            cameras=[CameraAccess(**token) for token in tokens],
            address=address,
            local=local,
        )

    @router.post("/api/v1/access/operator", status_code=201)
    def renew_operator() -> OperatorToken:
        """Make a new operator's token; the old one becomes invalid and everybody is signed out, this browser too."""
        return OperatorToken(token=access.renew_operator())

    @router.post("/api/v1/access/viewers", status_code=201)
    def renew_viewers(request: Request) -> ViewerLink:
        """Make a new link for viewers, who see the stage and cannot change it; the old link and its viewers are
        signed out."""
        token = access.renew_viewer()
        return ViewerLink(token=token, link=f"{address_for_others(request).url}/signin#{token}")

    @router.post("/api/v1/access/cameras", status_code=201)
    def add_camera(body: NewCamera, request: Request) -> MadeCamera:
        """Make a token for cameras, for `studio camera --token`."""
        token_id, token = access.add_camera(body.label)
        server = address_for_others(request).url
        command = f"studio camera --source SOURCE --server {server} --token {token}"
        return MadeCamera(id=token_id, token=token, command=command)

    @router.delete("/api/v1/access/cameras/{token_id}", status_code=204)
    def remove_camera(token_id: str) -> Response:
        """Revoke a camera's token; cameras connected with it are disconnected."""
        access.remove_camera(token_id)
        return Response(status_code=204)

    return router
