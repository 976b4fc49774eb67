"""Routes of the 3D view under `/api/v1/view`: layers, trails, colours, the operator's view, the poses' clock."""

from typing import Annotated

from fastapi import APIRouter
from pydantic import BaseModel, ConfigDict, Field

from studio.api.stage.shown import Layer, PointCamera, Points, RobotGaveWay, StrainedRobotJoint, ViewState
from studio.api.structs import StructRoute
from studio.engine.base.errors import SettingsError
from studio.engine.model.performers.colours import PERFORMER_COLOURS
from studio.web.playback.robots import ChosenRobots
from studio.web.points.maker import COLOURS
from studio.web.scene.operator import OperatorView
from studio.web.scene.palette import as_hex
from studio.web.scene.scene import LAYERS
from studio.web.view import LiveView

_MAX_M = 10_000.0
_Metres = Annotated[float, Field(ge=-_MAX_M, le=_MAX_M)]
_Point = tuple[_Metres, _Metres, _Metres]


class Clock(BaseModel):
    """The server's clock, on which the 3D view stamps its poses."""

    server_s: float


class PointsChange(BaseModel):
    """Changes of the points: their colour, cameras to show or hide."""

    model_config = ConfigDict(extra="forbid")

    colour: str | None = Field(None, description=f"one of {', '.join(COLOURS)}")
    cameras: dict[str, bool] = Field(default_factory=dict)


class ViewChange(BaseModel):
    """Changes of the view: layers to show or hide, by name; joints with trails; the points; the robot or
    mannequin that everybody is drawn as."""

    model_config = ConfigDict(extra="forbid")

    layers: dict[str, bool] = Field(default_factory=dict)
    trails: list[str] | None = Field(None, description="output joints", examples=[["LeftHand", "RightHand"]])
    points: PointsChange | None = None
    robot: str | None = Field(
        None, max_length=64, description="name of a kept robot; empty: a mannequin", examples=["g1"]
    )


class OperatorViewChange(BaseModel):
    """Viewpoint of a page of the operator, in the stage frame."""

    model_config = ConfigDict(extra="forbid")

    page: int = Field(ge=1, lt=2**53, description="a random number, one per page")
    position_m: _Point
    target_m: _Point = Field(description="the point in the middle of the picture")
    aspect: float = Field(gt=0.0, lt=100.0, description="of the picture, width over height")
    moved: bool = Field(description="the operator moved it; else it moved by itself")


class OperatorPage(BaseModel):
    """The page whose viewpoint is the operator's view."""

    page: int


class GizmoState(BaseModel):
    """The gizmo: its place, stage frame [m], and the number of drags since it is shown; `shown` is false while there
    is none."""

    shown: bool
    place_m: tuple[float, float, float] | None = None
    drags: int = 0


class GizmoPlace(BaseModel):
    """Place of the gizmo, stage frame."""

    model_config = ConfigDict(extra="forbid")

    place_m: _Point


class ShownPin(BaseModel):
    """A pin of the replayed take: its place, stage frame, and its radius [m]."""

    model_config = ConfigDict(extra="forbid")

    place_m: _Point
    radius_m: float = Field(0.0, ge=0.0, le=100.0)
    on: bool = True


class ShownPins(BaseModel):
    """The pins that the view shows."""

    model_config = ConfigDict(extra="forbid")

    pins: list[ShownPin] = Field(max_length=2000)


def view_routes(view: LiveView, robots: ChosenRobots) -> APIRouter:
    """Return the routes of one view."""
    router = APIRouter(prefix="/api/v1/view", tags=["view"], route_class=StructRoute)

    @router.get("")
    def get_view() -> ViewState:
        """The content of the 3D view."""
        return view_state(view, robots)

    @router.get("/clock")
    async def get_clock() -> Clock:
        """The server's present clock; a page that asks a few times can estimate its own offset."""
        return Clock(server_s=view.clock())

    @router.put("")
    def put_view(change: ViewChange) -> ViewState:
        """Change the view in every browser; missing fields stay."""
        unknown = [name for name in change.layers if name not in LAYERS]
        if unknown:
            raise SettingsError(
                "view.layer",
                "unknown layer {layer!r}; allowed: {allowed}",
                layer=unknown[0],
                allowed=[*LAYERS],
            )
        view.set_layers(change.layers)
        if change.trails is not None:
            view.set_trail_joints(change.trails)
        if change.points is not None:
            view.choose_points(change.points.colour, change.points.cameras)
        if change.robot is not None:
            robots.choose(change.robot)
        return view_state(view, robots)

    @router.put("/operator")
    def put_operator_view(change: OperatorViewChange) -> OperatorPage:
        """Report the viewpoint of a page of the operator. That of the page moved last is the operator's view, which
        other browsers can follow."""
        shown = OperatorView(change.page, change.position_m, change.target_m, change.aspect)
        return OperatorPage(page=view.show_operator(shown, moved=change.moved))

    @router.delete("/operator", status_code=204)
    def close_operator_view(page: int) -> None:
        """Report that a page was closed: if its viewpoint is the operator's view, there is none until a page reports
        its own."""
        view.forget_operator(page)

    @router.get("/gizmo")
    async def get_gizmo() -> GizmoState:
        """The gizmo by which a joint is dragged to its place."""
        return _gizmo_state(view)

    @router.put("/gizmo")
    def show_gizmo(change: GizmoPlace) -> GizmoState:
        """Show the gizmo at a place in the shown frame; it disappears with the frame."""
        view.gizmo.show(change.place_m)
        return _gizmo_state(view)

    @router.delete("/gizmo")
    def hide_gizmo() -> GizmoState:
        """Hide the gizmo."""
        view.gizmo.hide()
        return _gizmo_state(view)

    @router.put("/pins")
    def show_pins(change: ShownPins) -> ShownPins:
        """Show the pins of the replayed take, until the live stage is shown."""
        view.pins.show([(pin.place_m, pin.radius_m, pin.on) for pin in change.pins])
        return change

    return router


def _gizmo_state(view: LiveView) -> GizmoState:
    state = view.gizmo.state()
    if state is None:
        return GizmoState(shown=False)
    return GizmoState(shown=True, place_m=state[0], drags=state[1])


def view_state(view: LiveView, robots: ChosenRobots) -> ViewState:
    """Return the content of a view."""
    shown, points = view.layers, view.points.status()
    return ViewState(
        layers={name: Layer(label=label, shown=shown[name]) for name, (label, _) in LAYERS.items()},
        colours={name: as_hex(rgb) for name, rgb in view.colours.items()},
        trails=list(view.trail_joints),
        points=Points(
            colour=points.colour,
            colours=list(COLOURS),
            cameras={
                name: PointCamera(shown=on, says=points.says.get(name, "") if on else "")
                for name, on in points.cameras.items()
            },
            problem=points.problem,
        ),
        robots=robots.names(),
        robot=robots.name,
        robot_strained=[
            StrainedRobotJoint(number, one.joint, one.frame_share, one.most, one.at_s)
            for number, joints in robots.strained().items()
            for one in joints
        ],
        robot_gave_way=[
            RobotGaveWay(number, one.begin_s, one.end_s, one.most_m, one.point)
            for number, times in robots.gave_way().items()
            for one in times
        ],
        performer_colours=[as_hex(rgb) for rgb in PERFORMER_COLOURS],
    )
