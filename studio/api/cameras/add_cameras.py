"""Routes by which the page adds cameras: the simulated stage, a recording played as cameras, a client elsewhere."""

import base64
from typing import Annotated

from fastapi import APIRouter, Request
from pydantic import BaseModel, ConfigDict, Field

from studio.api.access import Access
from studio.api.address import address_for_others, own_url
from studio.api.cameras.local_cameras import LocalCameras, LocalCamerasStatus
from studio.api.cameras.qr import qr_picture
from studio.api.cameras.recordings import Recordings
from studio.api.cameras.simulated import simulated_sources
from studio.api.errors import RESPONSES
from studio.api.structs import StructRoute
from studio.engine.base.errors import SettingsError
from studio.live.borrowed import brings_calibration, calibration_of_recording

CAMERA_PAGE = "/camera"


class StartRequest(BaseModel):
    """A source to start on the server's machine: the simulated stage, or a recording."""

    model_config = ConfigDict(extra="forbid")

    simulated: bool = False
    recording: Annotated[str, Field(max_length=500)] | None = Field(
        None, description="its id", examples=["takes/monday/take_001"]
    )


class PlayableRecording(BaseModel):
    """A recording that can be played as cameras; without names if only playing it shows them."""

    id: str
    cameras: list[str]
    calibrated: bool = Field(description="it brings a calibration, which is used while it plays")


class InviteRequest(BaseModel):
    """The label of a camera's token, if the studio requires tokens."""

    model_config = ConfigDict(extra="forbid")

    label: str = Field("", max_length=60)


class CameraInvitation(BaseModel):
    """Instructions for a camera on another machine."""

    server: str = Field(description="the studio's address, as `studio camera --server` takes it")
    token: str = Field(description="shown only once; empty where the studio asks for none")
    url: str = Field(description="a page with the command, for that machine")
    qr: str = Field(description="the same as a QR code: SVG in base64")
    local: bool = Field(description="this server answers on its own machine only")


def add_cameras_router(access: Access, local: LocalCameras, recordings: Recordings) -> APIRouter:
    """Return the routes."""
    router = APIRouter(prefix="/api/v1", tags=["cameras"], responses=RESPONSES, route_class=StructRoute)

    @router.get("/local-cameras")
    def get_local_cameras() -> LocalCamerasStatus:
        """The camera clients that run on the server's machine: what is `opened`, and each camera's state."""
        return local.status()

    @router.post("/local-cameras", status_code=201)
    def open_cameras(request: StartRequest, http: Request) -> LocalCamerasStatus:
        """Start the simulated stage or a recording's cameras here, in place of the running ones."""
        if request.simulated == (request.recording is not None):
            raise SettingsError("camera.simulated_or_recording", "give either simulated=true or a recording")
        if request.recording is None:
            local.start_simulated(own_url(http), simulated_sources())
        else:
            found = recordings.find(request.recording)
            calibration = calibration_of_recording(found.path, found.cameras)
            local.start(found.sources(), found.id, own_url(http), calibration)
        return local.status()

    @router.delete("/local-cameras")
    def close_cameras() -> LocalCamerasStatus:
        """Stop the cameras that run here."""
        local.stop()
        return local.status()

    @router.get("/recordings")
    def get_recordings() -> list[PlayableRecording]:
        """Recordings that can be played as cameras: takes, and those in the folder of the configuration's
        `recordings`."""
        return [
            PlayableRecording(
                id=one.id,
                cameras=list(one.cameras),
                calibrated=brings_calibration(one.path, one.cameras),
            )
            for one in recordings.list()
        ]

    @router.post("/cameras/invite", status_code=201)
    def invite(request: InviteRequest, http: Request) -> CameraInvitation:
        """Return the instructions for a camera on another machine; makes a token if the studio requires one."""
        server, only_here = address_for_others(http)
        token = access.add_camera(request.label or "added on the page")[1] if access.required else ""
        url = server + CAMERA_PAGE + (f"#{token}" if token else "")
        picture = base64.b64encode(bytes(qr_picture(url).body)).decode("ascii")
        return CameraInvitation(server=server, token=token, url=url, qr=picture, local=only_here)

    return router
