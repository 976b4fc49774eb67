"""What the 3D view shows, as its routes and the events report it; the view itself is a room above."""

from typing import Any

from msgspec import UNSET, Struct, UnsetType


class Layer(Struct):
    """A layer of the view: its label, and whether it is shown."""

    label: str
    shown: bool


class PointCamera(Struct):
    """A camera with depth: whether its points are shown; if they should be but are not, the reason: `no_place` (the
    calibration lacks the camera), `no_image` (none at this instant), `damaged`."""

    shown: bool
    says: str


class Points(Struct):
    """Points in the view: the colour in use and the available ones, the cameras with depth; `problem` of the whole
    take: `reading` or `unreadable`. Cameras are unknown while points are not shown."""

    colour: str
    colours: list[str]
    cameras: dict[str, PointCamera]
    problem: str


class StrainedRobotJoint(Struct):
    """A joint of the replayed robot that needs more torque than its limit: number of the performer, share of frames,
    the largest torque as a multiple of the limit, and its time since the performance began [s]."""

    performer: int
    joint: str
    frame_share: float
    most: float
    at_s: float


class RobotGaveWay(Struct):
    """A time in which the replayed robot left its pose to stay within torque limits: number of the performer, begin
    and end since the performance began [s], the largest deviation of a key point [m], and the name of that point."""

    performer: int
    begin_s: float
    end_s: float
    most_m: float
    point: str


class ViewState(Struct):
    """What the 3D view shows in all browsers: layers by name, a colour (`#rrggbb`) per camera, joints with trails,
    points; `robots`: the kept ones; `robot`: the one as which everybody is drawn, "" = a mannequin;
    `robot_strained`: its joints with too much torque in the replayed solve; `robot_gave_way`: when its motion gave
    way; `performer_colours`: of several performers, by number from 1, repeated where there are more."""

    layers: dict[str, Layer]
    colours: dict[str, str]
    trails: list[str]
    points: Points
    robots: list[str]
    robot: str
    robot_strained: list[StrainedRobotJoint]
    robot_gave_way: list[RobotGaveWay]
    performer_colours: list[str]


class SecondFigure(Struct, frozen=True):
    """What is shown beside a replayed solve: another one, `lined_up` where a comparison placed it, or a reference."""

    take: str
    solve: str | UnsetType = UNSET
    reference: str | UnsetType = UNSET
    lined_up: bool | UnsetType = UNSET


class ReplayedPerformer(Struct):
    """One of several performers of a replayed solve: who it is (`performer_1`, ...), their name, and their colour in
    the view (`#rrggbb`)."""

    performer: str
    name: str
    colour: str


class ReplayStatus(Struct):
    """State of the replay; only `open` while the live stage is shown.

    Where there are several `performers`, `performer` is the one of the curves and the edit list.
    Frames count from 0. `begins_s` is stage time, `time_s` the time since the performance began [s]; the second
    figure is `ghost_offset_ms` ahead and stands `ghost_apart_m` to the side. `holds` says what a take without a solve
    holds. `of_s` is the final length of a solve that is still being made [s].
    """

    open: bool
    take: str | UnsetType = UNSET
    solve: str | UnsetType = UNSET
    performer: str | UnsetType = UNSET
    performers: list[ReplayedPerformer] | UnsetType = UNSET
    ghost: SecondFigure | UnsetType | None = UNSET
    ghost_offset_ms: float | UnsetType = UNSET
    ghost_apart_m: float | UnsetType = UNSET
    begins_s: float | UnsetType = UNSET
    frames: int | UnsetType = UNSET
    rate_hz: float | UnsetType = UNSET
    frame: int | UnsetType = UNSET
    time_s: float | UnsetType = UNSET
    playing: bool | UnsetType = UNSET
    speed: float | UnsetType = UNSET
    loop: bool | UnsetType = UNSET
    first: int | UnsetType = UNSET
    last: int | UnsetType = UNSET
    has_trace: bool | UnsetType = UNSET
    holds: dict[str, Any] | UnsetType | None = UNSET
    of_s: float | UnsetType | None = UNSET
