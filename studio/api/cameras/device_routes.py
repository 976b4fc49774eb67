"""Routes of the devices that are plugged into the server's machine: the list, pictures, connecting by a click."""

from typing import Any

from fastapi import APIRouter, Request
from fastapi.responses import Response
from pydantic import BaseModel, ConfigDict, Field

from studio.api.address import own_url
from studio.api.cameras.devices import DeviceList, Devices, DeviceStatus
from studio.api.errors import RESPONSES
from studio.api.structs import StructRoute

_PNG: dict[int | str, dict[str, Any]] = {200: {"content": {"image/png": {}}}}


class ConnectRequest(BaseModel):
    """The name of the camera that a device becomes."""

    model_config = ConfigDict(extra="forbid")

    name: str = Field("", max_length=63, description="empty: the one in the list")


def devices_router(devices: Devices) -> APIRouter:
    """Return the routes; a device is named by its id in the list, never by a source."""
    router = APIRouter(
        prefix="/api/v1/devices", tags=["cameras"], responses=RESPONSES, route_class=StructRoute
    )

    @router.get("")
    def get_devices() -> DeviceList:
        """The devices of the server's machine, as the last search found them."""
        return devices.status()

    @router.post("/search", status_code=202)
    def search() -> DeviceList:
        """Begin to look for devices, without opening any; `GET` says what was found so far."""
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

    return router
