"""What the 3D view draws next: on the drawing thread, from what is wanted to viser's scene."""

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
import viser
from numpy.typing import NDArray
from viser._messages import SetPositionMessage

from studio.engine.calibration.result import Calibration
from studio.engine.frames import StepResult
from studio.engine.joints import OUTPUT_INDEX
from studio.web.frusta import Picture
from studio.web.scene import Scene
from studio.web.viewpoint import Viewpoint

LOST_AFTER_S = 0.6
"""A performer whom no camera has seen for this long is hidden."""

TRAIL_FRAMES = 45
"""Drawn frames that a trail of the live stage reaches back."""

LOOK_S = 0.1
"""How often it is asked what surrounds the performer."""

CLOCK_NODE = "/clock"
"""A node without anything to see. Its position tells browsers, with every pose of the live stage, when the pose was
captured and when it was drawn, on the server's clock [s]; a replayed pose leaves it as it is."""


@dataclass(frozen=True)
class Surroundings:
    """What is around the performer.

    Attributes:
        calibration: the one in use, if there is one.
        cameras: names in the order of their colours.
        pictures: what cameras see, by name, of those that tell.
        clock_offset_ns: the server's clock less the stage's; None while the stage has no clock.
    """

    calibration: Calibration | None
    cameras: list[str]
    pictures: dict[str, Picture] = field(default_factory=dict)
    clock_offset_ns: int | None = None


Look = Callable[[], Surroundings]


@dataclass(frozen=True)
class Shown:
    """What is drawn: a step, another beside it, where the joints were before, shape (N, 52, 3), the calibration."""

    result: StepResult
    ghost: StepResult | None
    trail: NDArray[np.float64]
    calibration: Calibration | None


@dataclass(frozen=True)
class Wanted:
    """What is to be drawn.

    Attributes:
        live: the newest step of the live stage, where it is new.
        replay: a frame of a take, shown instead of the live stage; replay_is_new: it was not drawn before.
        layers: layer -> whether it is shown.
        trail_joints: output joints that draw a trail.
        viewpoint: where to look from, where that was chosen just now.
    """

    live: StepResult | None
    replay: Shown | None
    replay_is_new: bool
    layers: dict[str, bool]
    trail_joints: tuple[str, ...]
    viewpoint: str | None


class Drawing:
    """Draws on one viser server; all methods are called from one thread. Nothing moves while no browser looks."""

    def __init__(self, server: viser.ViserServer, look: Look) -> None:
        self.scene = Scene(server)
        self._server = server
        self._look = look
        self._viewpoint = Viewpoint(server)
        self._trail: deque[NDArray[np.float64]] = deque(maxlen=TRAIL_FRAMES)
        self._around: Surroundings | None = None
        self._looked_s = self._seen_s = -np.inf
        self._last: Shown | None = None
        self._drawn_for: tuple[frozenset[int], dict[str, bool], tuple[str, ...]] | None = None
        server.scene.add_frame(CLOCK_NODE, show_axes=False, visible=False)

    def draw(self, wanted: Wanted, now_s: float) -> None:
        """Bring the browsers' scene up to date; `now_s` is on the server's clock."""
        if wanted.replay is None and wanted.live is not None and _sees_performer(wanted.live):
            self._seen_s = now_s
        visible = wanted.replay is not None or now_s - self._seen_s < LOST_AFTER_S
        around = self._surroundings(now_s)
        step = self._next(wanted, around, visible=visible)
        if wanted.viewpoint is not None:
            self._viewpoint.choose(wanted.viewpoint)
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
        cameras_m = self.scene.camera_places_m()
        self._viewpoint.place_new_browsers(cameras_m, now_s)
        self._viewpoint.update(
            None if self._last is None else self._last.result.positions_m[0], now_s, cameras_m
        )

    def _surroundings(self, now_s: float) -> Surroundings:
        if self._around is None or now_s - self._looked_s >= LOOK_S:
            self._around, self._looked_s = self._look(), now_s
        return self._around

    def _next(self, wanted: Wanted, around: Surroundings, *, visible: bool) -> Shown | None:
        """Return what is new to be drawn."""
        if wanted.replay is not None or not visible:
            self._trail.clear()
        if wanted.replay is not None:
            return wanted.replay if wanted.replay_is_new else None
        if wanted.live is None or not visible:
            return None
        self._trail.append(wanted.live.positions_m)
        return Shown(wanted.live, None, np.array(self._trail), around.calibration)

    def _draw_stage(self, wanted: Wanted, around: Surroundings) -> None:
        replay = wanted.replay
        self.scene.use_cameras(_cameras(around, replay))
        self.scene.use_calibration(around.calibration if replay is None else replay.calibration)
        self.scene.show_pictures(around.pictures if replay is None else {})
        for layer, on in wanted.layers.items():
            self.scene.show_layer(layer, on)

    def _draw_performer(self, step: Shown, wanted: Wanted) -> None:
        self.scene.draw(step.result, step.ghost)
        self.scene.draw_trails(step.trail[:, [OUTPUT_INDEX[name] for name in wanted.trail_joints]])

    def _tell_time(self, step: StepResult, around: Surroundings, now_s: float) -> None:
        """Send the times with the pose, as they are: viser's handle takes seconds that hardly differ as equal."""
        if around.clock_offset_ns is not None:
            captured_s = (step.frame_set.stage_time_ns + around.clock_offset_ns) * 1e-9
            self._server.scene._queue_scene_message(SetPositionMessage(CLOCK_NODE, (captured_s, now_s, 0.0)))


def _cameras(around: Surroundings, replay: Shown | None) -> list[str]:
    """Return all cameras that are here, calibrated or replayed: each has one colour, whatever is shown."""
    calibrations = (around.calibration, None if replay is None else replay.calibration)
    placed = [name for calibration in calibrations if calibration for name in calibration.cameras]
    replayed = () if replay is None else replay.result.frame_set.cameras
    return sorted({*around.cameras, *placed, *replayed})


def _sees_performer(result: StepResult) -> bool:
    """Whether a camera saw any of the performer in this step (and not only the memory of the filters)."""
    return bool(np.isfinite(result.frame_set.positions).all(axis=2).any())
