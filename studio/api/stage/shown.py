"""What the 3D view shows, as its routes and the events tell it; the view itself is a room above."""

from typing import Any

from msgspec import UNSET, Struct, UnsetType


class Layer(Struct):
    """A layer of the view: what people call it, and whether it is shown."""

    label: str
    shown: bool


class PointCamera(Struct):
    """A camera with depth: whether its points are shown, and if they should be and are not, why: `no_place` (the
    calibration does not know the camera), `no_image` (none of this instant), `damaged`."""

    shown: bool
    says: str


class Points(Struct):
    """What is shown of points: the colour and those to choose from, the cameras with depth; `problem`: `reading` or
    `unreadable`, of the whole take. Nothing is known of cameras while points are not shown."""

    colour: str
    colours: list[str]
    cameras: dict[str, PointCamera]
    problem: str


class StrainedRobotJoint(Struct):
    """A joint of the replayed robot that is asked for more torque than its limit: by whose motion (number of the
    performer), in which share of frames, at most how many times the limit, and when, since the performance began
    [s]."""

    performer: int
    joint: str
    frame_share: float
    most: float
    at_s: float


class RobotGaveWay(Struct):
    """A time in which the replayed robot gave way in pose for its torques: by whose motion (number of the performer),
    from when to when, since the performance began [s], how far a key point is at most from where it would be [m],
    and which."""

    performer: int
    begin_s: float
    end_s: float
    most_m: float
    point: str


class ViewState(Struct):
    """What the 3D view shows in all browsers: layers by name, a colour (`#rrggbb`) per camera, joints with trails,
    points; `robots`: the kept ones, `robot`: the one as which everybody is drawn, "" = a mannequin;
    `robot_strained`: joints of which its motion for the replayed solve asks too much; `robot_gave_way`: when that
    motion gave way; `performer_colours`: of several performers, by number from 1, repeated where there are more."""

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
    """Where the replay is; nothing but `open` while the live stage is shown.

    Where there are several `performers`, `performer` is the one of the curves and the edit list.
    Frames count from 0. `begins_s` is stage time, `time_s` the time since the performance began [s]; the second
    figure is `ghost_offset_ms` ahead and stands `ghost_apart_m` to the side. `holds` says what a take without a solve
    holds. `of_s` is the length of the whole of a solve that is still being made [s].
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
