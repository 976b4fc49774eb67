"""Routes of the 3D view under `/api/v1/view`: layers, trails, viewpoint, colours, and the clock of its poses."""

from fastapi import APIRouter
from pydantic import BaseModel, ConfigDict, Field

from studio.api.stage.shown import Layer, PointCamera, Points, ViewState
from studio.api.structs import StructRoute
from studio.engine.base.errors import SettingsError
from studio.web.points.maker import COLOURS
from studio.web.scene.palette import as_hex
from studio.web.scene.scene import LAYERS
from studio.web.scene.viewpoint import VIEWPOINTS
from studio.web.view import LiveView


class Clock(BaseModel):
    """The server's clock, on which the 3D view stamps its poses."""

    server_s: float


class PointsChange(BaseModel):
    """Changes of the points: their colour, cameras to show or hide."""

    model_config = ConfigDict(extra="forbid")

    colour: str | None = Field(None, description=f"one of {', '.join(COLOURS)}")
    cameras: dict[str, bool] = Field(default_factory=dict)


class ViewChange(BaseModel):
    """Changes of the view: layers to show or hide, by name; joints with trails; the viewpoint; the points."""

    model_config = ConfigDict(extra="forbid")

    layers: dict[str, bool] = Field(default_factory=dict)
    trails: list[str] | None = Field(None, description="output joints", examples=[["LeftHand", "RightHand"]])
    camera: str | None = Field(None, description=f"one of {', '.join(VIEWPOINTS)}")
    points: PointsChange | None = None


def view_routes(view: LiveView) -> APIRouter:
    """Return the routes of one view."""
    router = APIRouter(prefix="/api/v1/view", tags=["view"], route_class=StructRoute)

    @router.get("")
    def get_view() -> ViewState:
        """The content of the 3D view."""
        return view_state(view)

    @router.get("/clock")
    async def get_clock() -> Clock:
        """The server's present clock; a page that asks a few times can estimate its own offset."""
        return Clock(server_s=view.clock())

    @router.put("")
    def put_view(change: ViewChange) -> ViewState:
        """Change the view in every browser; missing fields stay."""
        unknown = [name for name in change.layers if name not in LAYERS]
        if unknown:
            raise SettingsError(f"unknown layer {unknown[0]!r}; allowed: {', '.join(LAYERS)}")
        view.set_layers(change.layers)
        if change.trails is not None:
            view.set_trail_joints(change.trails)
        if change.camera is not None:
            view.look_from(change.camera)
        if change.points is not None:
            view.choose_points(change.points.colour, change.points.cameras)
        return view_state(view)

    return router


def view_state(view: LiveView) -> ViewState:
    """Return the content of a view."""
    shown, points = view.layers, view.points.status()
    return ViewState(
        layers={name: Layer(label=label, shown=shown[name]) for name, (label, _) in LAYERS.items()},
        colours={name: as_hex(rgb) for name, rgb in view.colours.items()},
        trails=list(view.trail_joints),
        viewpoints=list(VIEWPOINTS),
        viewpoint=view.viewpoint,
        points=Points(
            colour=points.colour,
            colours=list(COLOURS),
            cameras={
                name: PointCamera(shown=on, says=points.says.get(name, "") if on else "")
                for name, on in points.cameras.items()
            },
            problem=points.problem,
        ),
    )
