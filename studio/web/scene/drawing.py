"""Drawing of the 3D view, on the drawing thread, into viser's scene."""

from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace

import numpy as np
import viser
from numpy.typing import NDArray
from viser._messages import SetPositionMessage

from studio.engine.model.calibration import Calibration
from studio.engine.model.frames import StepResult
from studio.engine.model.joints import OUTPUT_INDEX
from studio.web.scene.clouds import Cloud
from studio.web.scene.frusta import Picture
from studio.web.scene.operator import OperatorNodes, OperatorView
from studio.web.scene.performers.robot import ChosenRobot
from studio.web.scene.scene import Scene

LOST_AFTER_S = 0.6
"""Time after which a performer not seen by any camera is hidden [s]."""

TRAIL_FRAMES = 45
"""Length of the live stage's trails, in drawn frames."""

_STEP_M = 0.002
_NOWHERE = (0.0, 0.0, 0.0)

LOOK_S = 0.1
"""Interval of updates of the surroundings."""

CLOCK_NODE = "/clock"
"""An invisible node. Its position tells browsers, with every pose of the live stage, the times of the pose's
capture and drawing, on the server's clock [s]; replayed poses do not change it.
"""

PLACES_NODE = "/places"
"""Prefix of nodes by performer, `/places/1` and so on. Their positions are the performer's place on the floor x, y
[m], and 1 if that performer is drawn."""

BEAT_NODE = "/beat"
BEAT_S = 0.5
"""Interval at which `BEAT_NODE` always moves [s]; if it does not, a browser's picture is out of date."""


@dataclass(frozen=True)
class Surroundings:
    """The surroundings of the performer.

    Attributes:
        calibration: the one in use, if there is one.
        cameras: names in the order of their colours.
        pictures: the cameras' pictures, by name, if any.
        clock_offset_ns: the server's clock minus the stage's; None while the stage has no clock.
        names: of performers by number, if there are several.
    """

    calibration: Calibration | None
    cameras: list[str]
    pictures: dict[str, Picture] = field(default_factory=dict)
    clock_offset_ns: int | None = None
    names: Mapping[int, str] = field(default_factory=dict)


Look = Callable[[], Surroundings]


@dataclass(frozen=True)
class DrawnStep:
    """A step to draw, of one performer or several.

    Attributes:
        result: the step.
        ghost: another step, with each figure next to its performer.
        trails: the joints' earlier places by the performer's number, shape (N, 52, 3).
        calibration: places of the cameras.
        names: of performers by number, if there are several: each has their own colour.
        robots: configurations of `robot` by the performer's number, shape (nq,); without one it follows the step.
        robot: name of the robot whose configurations they are.
    """

    result: StepResult
    ghost: StepResult | None
    trails: Mapping[int, NDArray[np.float64]]
    calibration: Calibration | None
    names: Mapping[int, str] = field(default_factory=dict)
    robots: Mapping[int, NDArray[np.float64]] = field(default_factory=dict)
    robot: str = ""


@dataclass(frozen=True)
class Wanted:
    """The requested content of the view.

    Attributes:
        live: the newest step of the live stage, if it is new.
        replay: a frame of a take, shown instead of the live stage; replay_is_new: it was not drawn before.
        layers: layer -> whether it is shown.
        trail_joints: output joints that draw a trail.
        operator: the operator's view, once there is one.
        clouds: the cameras' points, by camera.
        robot: drawn in place of everybody; None = a mannequin.
    """

    live: StepResult | None
    replay: DrawnStep | None
    replay_is_new: bool
    layers: dict[str, bool]
    trail_joints: tuple[str, ...]
    operator: OperatorView | None = None
    clouds: Mapping[str, Cloud] = field(default_factory=dict)
    robot: ChosenRobot | None = None


class Drawing:
    """Draws on one viser server; all methods are called from one thread. Nothing is drawn while no browser is
    connected."""

    def __init__(self, server: viser.ViserServer, look: Look) -> None:
        self.scene = Scene(server)
        self._server = server
        self._look = look
        self._operator = OperatorNodes(server)
        self._places: dict[int, tuple[float, float, float]] = {}
        self._trails: dict[int, deque[NDArray[np.float64]]] = {}
        self._around: Surroundings | None = None
        self._looked_s = -np.inf
        self._seen_s: dict[int, float] = {}
        self._last: DrawnStep | None = None
        self._drawn_for: tuple[object, ...] | None = None
        self._beat_s = -np.inf
        for node in (CLOCK_NODE, BEAT_NODE):
            server.scene.add_frame(node, show_axes=False, visible=False)

    def draw(self, wanted: Wanted, now_s: float) -> None:
        """Update the browsers' scene; `now_s` is on the server's clock."""
        if wanted.replay is None and wanted.live is not None:
            self._seen_s |= dict.fromkeys(_seen(wanted.live), now_s)
        here = {number for number, seen_s in self._seen_s.items() if now_s - seen_s < LOST_AFTER_S}
        visible = wanted.replay is not None or bool(here)
        around = self._surroundings(now_s)
        step = self._next(wanted, around, here)
        browsers = frozenset(self._server.get_clients())
        drawn_for = (browsers, wanted.layers, wanted.trail_joints, wanted.robot)
        changed, self._drawn_for = drawn_for != self._drawn_for, drawn_for
        with self._server.atomic():
            self._draw_stage(wanted, around)
            if step is not None:
                self._last = step
            elif not visible and self._last is not None:
                self.scene.hide_performers()
                self._last = None
            if browsers and self._last is not None and (step is not None or changed):
                self._draw_performers(self._last, wanted)
                if wanted.replay is None and wanted.live is not None:
                    self._tell_time(wanted.live, around, now_s)
        self._tell_places()
        self._operator.show(wanted.operator)
        if browsers and now_s - self._beat_s >= BEAT_S:
            self._beat_s = now_s
            self._send_times(BEAT_NODE, now_s, now_s)

    def _surroundings(self, now_s: float) -> Surroundings:
        if self._around is None or now_s - self._looked_s >= LOOK_S:
            self._around, self._looked_s = self._look(), now_s
        return self._around

    def _next(self, wanted: Wanted, around: Surroundings, here: set[int]) -> DrawnStep | None:
        """Return the new step to draw, of those who are `here`."""
        live = wanted.live
        if wanted.replay is not None:
            self._trails.clear()
            return wanted.replay if wanted.replay_is_new else None
        for number in [number for number in self._trails if number not in here]:
            del self._trails[number]
        if live is None or not here:
            return None
        steps = [one for one in live.each() if one.performer in here] or [live]
        for one in steps:
            if _has_body(one):
                self._trails.setdefault(one.performer, deque(maxlen=TRAIL_FRAMES)).append(one.positions_m)
        result = replace(steps[0], others=tuple(steps[1:]), strangers=live.strangers, bodies=live.bodies)
        trails = {number: np.array(trail) for number, trail in self._trails.items()}
        return DrawnStep(result, None, trails, around.calibration, around.names)

    def _draw_stage(self, wanted: Wanted, around: Surroundings) -> None:
        replay = wanted.replay
        shown = wanted.live if replay is None else replay.result
        if shown is None and self._last is not None:
            shown = self._last.result
        self.scene.use_robot(wanted.robot)
        self.scene.use_cameras(_cameras(around, replay))
        self.scene.use_calibration(around.calibration if replay is None else replay.calibration)
        self.scene.show_pictures(around.pictures if replay is None else {})
        raw_only = shown is not None and not _has_body(shown)
        for layer, on in wanted.layers.items():
            self.scene.show_layer(layer, on or (raw_only and layer == "raw"))
        self.scene.draw_clouds(wanted.clouds)

    def _draw_performers(self, step: DrawnStep, wanted: Wanted) -> None:
        joints = [OUTPUT_INDEX[name] for name in wanted.trail_joints]
        trails = {number: trail[:, joints] for number, trail in step.trails.items()}
        own = wanted.robot is not None and wanted.robot.robot.name == step.robot
        robots = step.robots if own else {}
        self.scene.draw(step.result, step.ghost, names=step.names, trails=trails, robots=robots)

    def _tell_time(self, step: StepResult, around: Surroundings, now_s: float) -> None:
        """Send the times with the pose."""
        if around.clock_offset_ns is not None:
            captured_s = (step.frame_set.stage_time_ns + around.clock_offset_ns) * 1e-9
            self._send_times(CLOCK_NODE, captured_s, now_s)

    def _tell_places(self) -> None:
        steps = () if self._last is None else self._last.result.each()
        places = {one.performer: place for one in steps if (place := _place_m(one)) is not None}
        for number in {*places, *self._places}:
            self._tell_place(number, places.get(number, _NOWHERE))

    def _tell_place(self, number: int, place: tuple[float, float, float]) -> None:
        node = f"{PLACES_NODE}/{number}"
        if number not in self._places:
            self._server.scene.add_frame(node, show_axes=False, visible=False)
            self._places[number] = _NOWHERE
        before = self._places[number]
        if place[2] != before[2] or np.hypot(*np.subtract(place, before)[:2]) > _STEP_M:
            self._places[number] = place
            self._server.scene._queue_scene_message(SetPositionMessage(node, place))

    def _send_times(self, node: str, captured_s: float, now_s: float) -> None:
        """Move a node to two times directly, because viser's handle ignores small changes."""
        self._server.scene._queue_scene_message(SetPositionMessage(node, (captured_s, now_s, 0.0)))


def _cameras(around: Surroundings, replay: DrawnStep | None) -> list[str]:
    """Return all connected, calibrated or replayed cameras, so that each keeps its colour."""
    calibrations = (around.calibration, None if replay is None else replay.calibration)
    placed = [name for calibration in calibrations if calibration for name in calibration.cameras]
    steps = () if replay is None else replay.result.each()
    replayed = [name for one in steps for name in one.frame_set.cameras]
    return sorted({*around.cameras, *placed, *replayed})


def _has_body(result: StepResult) -> bool:
    """Whether a step has a body, not only the cameras' skeletons."""
    return bool(np.isfinite(result.positions_m[0]).all())


def _place_m(result: StepResult) -> tuple[float, float, float] | None:
    """Return the performer's place on the floor, and 1: the hips, else the middle of what cameras see."""
    place = result.positions_m[0]
    if not _has_body(result):
        seen = result.frame_set.positions
        known = seen[np.isfinite(seen).all(axis=-1)]
        if not len(known):
            return None
        place = known.mean(axis=0)
    return float(place[0]), float(place[1]), 1.0


def _seen(result: StepResult) -> list[int]:
    """Return the performers whom a camera saw in this step (not only the state of the filters); 0 = strangers."""
    seen = [one.performer for one in result.each() if np.isfinite(one.frame_set.positions).all(axis=2).any()]
    return [0, *seen] if result.strangers else seen
