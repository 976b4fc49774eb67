"""Routes of the devices that are plugged into the server's machine: the list, pictures, connecting by a click."""

from typing import Any

from fastapi import APIRouter, Request
from fastapi.responses import Response
from pydantic import BaseModel, ConfigDict, Field

from studio.api.address import address_for_others, own_url
from studio.api.cameras.announced import Announced, AnnouncedList
from studio.api.cameras.devices import DeviceList, Devices, DeviceStatus
from studio.api.errors import RESPONSES
from studio.api.structs import StructRoute

_PNG: dict[int | str, dict[str, Any]] = {200: {"content": {"image/png": {}}}}


class ConnectRequest(BaseModel):
    """The name of the camera that a device becomes."""

    model_config = ConfigDict(extra="forbid")

    name: str = Field("", max_length=63, description="empty: the one in the list")


class CallRequest(BaseModel):
    """The code that a waiting client shows."""

    model_config = ConfigDict(extra="forbid")

    code: str = Field(min_length=1, max_length=40)


def devices_router(devices: Devices, announced: Announced) -> APIRouter:
    """Return the routes; devices and cameras are named by their ids in the lists, never by a source or an address."""
    router = APIRouter(
        prefix="/api/v1/devices", tags=["cameras"], responses=RESPONSES, route_class=StructRoute
    )

    @router.get("")
    def get_devices() -> DeviceList:
        """The devices of the server's machine, as the last search found them."""
        return devices.status()

    @router.post("/search", status_code=202)
    def search() -> DeviceList:
        """Begin to look for devices, without opening any; `GET` lists those found so far."""
        announced.listen()
        return devices.search()

    @router.post("/{device}/picture")
    def take_picture(device: str) -> DeviceStatus:
        """Open a free device for a moment and keep a picture; `picture_problem` says why there is none."""
        return devices.take_picture(device)

    @router.get("/{device}/picture", response_class=Response, responses=_PNG)
    def get_picture(device: str) -> Response:
        """The newest picture of a device, PNG: colour, or depth with near = bright, black = no reading."""
        return Response(
            devices.picture(device), media_type="image/png", headers={"Cache-Control": "no-store"}
        )

    @router.post("/{device}/connect", status_code=201)
    def connect(device: str, request: ConnectRequest, http: Request) -> DeviceStatus:
        """Start a camera client for a device, unless it runs already; the client ends with the server."""
        return devices.connect(device, request.name, own_url(http))

    @router.post("/{device}/disconnect")
    def disconnect(device: str) -> DeviceStatus:
        """Stop a device's client."""
        return devices.disconnect(device)

    @router.get("/announced")
    def get_announced() -> AnnouncedList:
        """The camera clients on other machines that wait for a studio, and those that were connected by a click."""
        return announced.status()

    @router.post("/announced/{camera}/connect", status_code=201)
    def call(camera: str, request: CallRequest, http: Request) -> AnnouncedList:
        """Connect a waiting client by the code that its terminal shows; it gets its own token."""
        announced.call(camera, request.code, address_for_others(http).url)
        return announced.status()

    @router.post("/announced/{camera}/disconnect")
    def let_go(camera: str) -> AnnouncedList:
        """Disconnect a client that was connected by a click; it waits again, with another code."""
        announced.let_go(camera)
        return announced.status()

    return router
