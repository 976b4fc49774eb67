"""Drawing of the 3D view, on the drawing thread, into viser's scene."""

from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

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
from studio.web.scene.scene import Scene

LOST_AFTER_S = 0.6
"""A performer not seen by any camera for this long is hidden."""

TRAIL_FRAMES = 45
"""Length of the live stage's trails, in drawn frames."""

_STEP_M = 0.002

LOOK_S = 0.1
"""Interval of updates of the surroundings."""

CLOCK_NODE = "/clock"
"""An invisible node. Its position tells browsers, with every pose of the live stage, the times of the pose's
capture and drawing, on the server's clock [s]; replayed poses do not change it.
"""

PLACE_NODE = "/place"
"""Another one, whose position is the performer's place on the floor x, y [m], and 1 where there is a performer."""

BEAT_NODE = "/beat"
BEAT_S = 0.5
"""Another node, which moves at this interval in any case; if it does not, a browser's picture is out of date."""


@dataclass(frozen=True)
class Surroundings:
    """The surroundings of the performer.

    Attributes:
        calibration: the one in use, if there is one.
        cameras: names in the order of their colours.
        pictures: the cameras' pictures, by name, if any.
        clock_offset_ns: the server's clock minus the stage's; None while the stage has no clock.
    """

    calibration: Calibration | None
    cameras: list[str]
    pictures: dict[str, Picture] = field(default_factory=dict)
    clock_offset_ns: int | None = None


Look = Callable[[], Surroundings]


@dataclass(frozen=True)
class DrawnStep:
    """A step to draw: the step, another beside it, the joints' earlier places, shape (N, 52, 3), the calibration."""

    result: StepResult
    ghost: StepResult | None
    trail: NDArray[np.float64]
    calibration: Calibration | None


@dataclass(frozen=True)
class Wanted:
    """The requested content of the view.

    Attributes:
        live: the newest step of the live stage, if it is new.
        replay: a frame of a take, shown instead of the live stage; replay_is_new: it was not drawn before.
        layers: layer -> whether it is shown.
        trail_joints: output joints that draw a trail.
        operator: the operator's view, once there is one.
        clouds: what cameras see, as points, by camera.
    """

    live: StepResult | None
    replay: DrawnStep | None
    replay_is_new: bool
    layers: dict[str, bool]
    trail_joints: tuple[str, ...]
    operator: OperatorView | None = None
    clouds: Mapping[str, Cloud] = field(default_factory=dict)


class Drawing:
    """Draws on one viser server; all methods are called from one thread. Nothing is drawn while no browser is
    connected."""

    def __init__(self, server: viser.ViserServer, look: Look) -> None:
        self.scene = Scene(server)
        self._server = server
        self._look = look
        self._operator = OperatorNodes(server)
        self._place = (0.0, 0.0, 0.0)
        self._trail: deque[NDArray[np.float64]] = deque(maxlen=TRAIL_FRAMES)
        self._around: Surroundings | None = None
        self._looked_s = self._seen_s = -np.inf
        self._last: DrawnStep | None = None
        self._drawn_for: tuple[frozenset[int], dict[str, bool], tuple[str, ...]] | None = None
        self._beat_s = -np.inf
        for node in (CLOCK_NODE, BEAT_NODE, PLACE_NODE):
            server.scene.add_frame(node, show_axes=False, visible=False)

    def draw(self, wanted: Wanted, now_s: float) -> None:
        """Update the browsers' scene; `now_s` is on the server's clock."""
        if wanted.replay is None and wanted.live is not None and _sees_performer(wanted.live):
            self._seen_s = now_s
        visible = wanted.replay is not None or now_s - self._seen_s < LOST_AFTER_S
        around = self._surroundings(now_s)
        step = self._next(wanted, around, visible=visible)
        browsers = frozenset(self._server.get_clients())
        drawn_for = (browsers, wanted.layers, wanted.trail_joints)
        changed, self._drawn_for = drawn_for != self._drawn_for, drawn_for
        with self._server.atomic():
            self._draw_stage(wanted, around)
            if step is not None:
                self._last = step
            elif not visible and self._last is not None:
                self.scene.hide_performer()
                self._last = None
            if browsers and self._last is not None and (step is not None or changed):
                self._draw_performer(self._last, wanted)
                if wanted.replay is None and wanted.live is not None:
                    self._tell_time(wanted.live, around, now_s)
        self._tell_place()
        self._operator.show(wanted.operator)
        if browsers and now_s - self._beat_s >= BEAT_S:
            self._beat_s = now_s
            self._send_times(BEAT_NODE, now_s, now_s)

    def _surroundings(self, now_s: float) -> Surroundings:
        if self._around is None or now_s - self._looked_s >= LOOK_S:
            self._around, self._looked_s = self._look(), now_s
        return self._around

    def _next(self, wanted: Wanted, around: Surroundings, *, visible: bool) -> DrawnStep | None:
        """Return the new step to draw."""
        if wanted.replay is not None or not visible:
            self._trail.clear()
        if wanted.replay is not None:
            return wanted.replay if wanted.replay_is_new else None
        if wanted.live is None or not visible:
            return None
        if _has_body(wanted.live):
            self._trail.append(wanted.live.positions_m)
        trail = np.array(self._trail).reshape(-1, *wanted.live.positions_m.shape)
        return DrawnStep(wanted.live, None, trail, around.calibration)

    def _draw_stage(self, wanted: Wanted, around: Surroundings) -> None:
        replay = wanted.replay
        shown = wanted.live if replay is None else replay.result
        if shown is None and self._last is not None:
            shown = self._last.result
        self.scene.use_cameras(_cameras(around, replay))
        self.scene.use_calibration(around.calibration if replay is None else replay.calibration)
        self.scene.show_pictures(around.pictures if replay is None else {})
        raw_only = shown is not None and not _has_body(shown)
        for layer, on in wanted.layers.items():
            self.scene.show_layer(layer, on or (raw_only and layer == "raw"))
        self.scene.draw_clouds(wanted.clouds)

    def _draw_performer(self, step: DrawnStep, wanted: Wanted) -> None:
        self.scene.draw(step.result, step.ghost)
        self.scene.draw_trails(step.trail[:, [OUTPUT_INDEX[name] for name in wanted.trail_joints]])

    def _tell_time(self, step: StepResult, around: Surroundings, now_s: float) -> None:
        """Send the times with the pose."""
        if around.clock_offset_ns is not None:
            captured_s = (step.frame_set.stage_time_ns + around.clock_offset_ns) * 1e-9
            self._send_times(CLOCK_NODE, captured_s, now_s)

    def _tell_place(self) -> None:
        place_m = None if self._last is None else _place_m(self._last.result)
        place = (0.0, 0.0, 0.0) if place_m is None else (float(place_m[0]), float(place_m[1]), 1.0)
        if place[2] != self._place[2] or np.hypot(*np.subtract(place, self._place)[:2]) > _STEP_M:
            self._place = place
            self._server.scene._queue_scene_message(SetPositionMessage(PLACE_NODE, place))

    def _send_times(self, node: str, captured_s: float, now_s: float) -> None:
        """Move a node to two times directly, because viser's handle ignores small changes."""
        self._server.scene._queue_scene_message(SetPositionMessage(node, (captured_s, now_s, 0.0)))


def _cameras(around: Surroundings, replay: DrawnStep | None) -> list[str]:
    """Return all connected, calibrated or replayed cameras, so that each keeps its colour."""
    calibrations = (around.calibration, None if replay is None else replay.calibration)
    placed = [name for calibration in calibrations if calibration for name in calibration.cameras]
    replayed = () if replay is None else replay.result.frame_set.cameras
    return sorted({*around.cameras, *placed, *replayed})


def _has_body(result: StepResult) -> bool:
    """Whether a step has a body, not only what cameras saw."""
    return bool(np.isfinite(result.positions_m[0]).all())


def _place_m(result: StepResult) -> NDArray[np.float64] | None:
    """Return where the performer is, shape (3,): the hips, without a body the middle of what cameras see."""
    if _has_body(result):
        return result.positions_m[0]
    seen = result.frame_set.positions
    known = seen[np.isfinite(seen).all(axis=-1)]
    return known.mean(axis=0) if len(known) else None


def _sees_performer(result: StepResult) -> bool:
    """Whether a camera saw any of the performer in this step (and not only the state of the filters)."""
    return bool(np.isfinite(result.frame_set.positions).all(axis=2).any())
