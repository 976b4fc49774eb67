"""Routes of the 3D view under `/api/v1/view`: layers, trails, viewpoint, colours, and the clock of its poses."""

from fastapi import APIRouter
from pydantic import BaseModel, ConfigDict, Field

from studio.engine.errors import SettingsError
from studio.web.palette import as_hex
from studio.web.scene import LAYERS
from studio.web.view import View
from studio.web.viewpoint import VIEWPOINTS


class Layer(BaseModel):
    """A layer of the view: what people call it, and whether it is shown."""

    label: str
    shown: bool


class ViewState(BaseModel):
    """What the 3D view shows: layers by name, a colour (`#rrggbb`) per camera, joints with trails, viewpoints and the
    one in use."""

    layers: dict[str, Layer]
    colours: dict[str, str]
    trails: list[str]
    viewpoints: list[str]
    viewpoint: str


class Clock(BaseModel):
    """The server's clock, on which the 3D view stamps its poses."""

    server_s: float


class ViewChange(BaseModel):
    """What changes in the view: layers to show or hide, by name; joints with trails; where to look from."""

    model_config = ConfigDict(extra="forbid")

    layers: dict[str, bool] = Field(default_factory=dict)
    trails: list[str] | None = Field(None, description="output joints", examples=[["LeftHand", "RightHand"]])
    camera: str | None = Field(None, description=f"one of {', '.join(VIEWPOINTS)}")


def view_routes(view: View) -> APIRouter:
    """Return the routes of one view."""
    router = APIRouter(prefix="/api/v1/view", tags=["view"])

    @router.get("")
    def get_view() -> ViewState:
        """What the 3D view shows."""
        return view_state(view)

    @router.get("/clock")
    async def get_clock() -> Clock:
        """The server's clock now: a page that asks a few times knows how its own lies to it."""
        return Clock(server_s=view.clock())

    @router.put("")
    def put_view(change: ViewChange) -> ViewState:
        """Change the view in every browser; what is not named stays as it is."""
        unknown = [name for name in change.layers if name not in LAYERS]
        if unknown:
            raise SettingsError(f"unknown layer {unknown[0]!r}; allowed: {', '.join(LAYERS)}")
        view.set_layers(change.layers)
        if change.trails is not None:
            view.set_trail_joints(change.trails)
        if change.camera is not None:
            view.look_from(change.camera)
        return view_state(view)

    return router


def view_state(view: View) -> ViewState:
    """Return what a view shows."""
    shown = view.layers
    return ViewState(
        layers={name: Layer(label=label, shown=shown[name]) for name, (label, _) in LAYERS.items()},
        colours={name: as_hex(rgb) for name, rgb in view.colours.items()},
        trails=list(view.trail_joints),
        viewpoints=list(VIEWPOINTS),
        viewpoint=view.viewpoint,
    )
