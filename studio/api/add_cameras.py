"""Routes by which the page adds cameras: the simulated stage, a recording played as cameras, a client elsewhere."""

import base64
from typing import Annotated, Any

from fastapi import APIRouter, Request
from pydantic import BaseModel, ConfigDict, Field

from studio.api.access import Access
from studio.api.errors import RESPONSES
from studio.api.local_cameras import LocalCameras
from studio.api.qr import qr_picture
from studio.api.recordings import Recordings
from studio.api.remote import root_address
from studio.engine.errors import SettingsError
from studio.live.borrowed import brings_calibration, calibration_of_recording

CAMERA_PAGE = "/camera"


class OpenRequest(BaseModel):
    """What is started on the server's machine: the simulated stage, or a recording."""

    model_config = ConfigDict(extra="forbid")

    simulated: bool = False
    recording: Annotated[str, Field(max_length=500)] | None = Field(
        None, description="its id", examples=["takes/monday/take_001"]
    )


class Recording(BaseModel):
    """A recording that can be played as cameras; no names where only playing it tells them."""

    id: str
    cameras: list[str]
    calibrated: bool = Field(description="it brings a calibration, which is used while it plays")


class InviteRequest(BaseModel):
    """Who a camera's token is for, where the studio asks for tokens."""

    model_config = ConfigDict(extra="forbid")

    label: str = Field("", max_length=60)


class Invitation(BaseModel):
    """How a camera on another machine joins."""

    server: str = Field(description="the studio's address, as `studio camera --server` takes it")
    token: str = Field(description="shown only once; empty where the studio asks for none")
    url: str = Field(description="a page with the command, for that machine")
    qr: str = Field(description="the same as a QR code: SVG in base64")
    local: bool = Field(description="this server answers on its own machine only")


def add_cameras_router(access: Access, local: LocalCameras, recordings: Recordings) -> APIRouter:
    """Return the routes."""
    router = APIRouter(prefix="/api/v1", tags=["cameras"], responses=RESPONSES)

    @router.get("/local-cameras")
    def get_local_cameras() -> dict[str, Any]:
        """The camera clients that run on the server's machine: what is `opened`, and how each camera does."""
        return local.status()

    @router.post("/local-cameras", status_code=201)
    def open_cameras(request: OpenRequest, http: Request) -> dict[str, Any]:
        """Start the simulated stage or a recording's cameras here, in place of those that run."""
        if request.simulated == (request.recording is not None):
            raise SettingsError("give either simulated=true or a recording")
        if request.recording is None:
            local.start_simulated(_own_url(http))
        else:
            found = recordings.find(request.recording)
            calibration = calibration_of_recording(found.path, found.cameras)
            local.start(found.sources(), found.id, _own_url(http), calibration)
        return local.status()

    @router.delete("/local-cameras")
    def close_cameras() -> dict[str, Any]:
        """Stop the cameras that run here."""
        local.stop()
        return local.status()

    @router.get("/recordings")
    def get_recordings() -> list[Recording]:
        """What can be played as cameras: takes, and recordings in the folder of the configuration's `recordings`."""
        return [
            Recording(
                id=one.id,
                cameras=list(one.cameras),
                calibrated=brings_calibration(one.path, one.cameras),
            )
            for one in recordings.list()
        ]

    @router.post("/cameras/invite", status_code=201)
    def invite(request: InviteRequest, http: Request) -> Invitation:
        """Tell how a camera on another machine joins; makes a token where the studio asks for one."""
        server = root_address(http, for_others=access.required)
        token = access.add_camera(request.label or "added on the page")[1] if access.required else ""
        url = server + CAMERA_PAGE + (f"#{token}" if token else "")
        picture = base64.b64encode(bytes(qr_picture(url).body)).decode("ascii")
        return Invitation(server=server, token=token, url=url, qr=picture, local=not access.required)

    return router


def _own_url(http: Request) -> str:
    """Return the address at which this server was reached, for programs on its own machine."""
    host, port = http.scope["server"]
    return f"{http.url.scheme}://{f'[{host}]' if ':' in host else host}:{port}"
