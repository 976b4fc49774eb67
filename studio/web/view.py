"""The 3D view: a viser server on the loopback, and a thread that draws the newest step, live or replayed."""

import io
import logging
import socket
import threading
import time
from collections.abc import Callable, Mapping
from contextlib import redirect_stdout
from types import MappingProxyType

import numpy as np
import viser
from numpy.typing import NDArray

from studio.engine.base.errors import SettingsError
from studio.engine.base.value_sentences import bad_setting
from studio.engine.model.calibration import Calibration
from studio.engine.model.frames import StepResult
from studio.engine.model.joints import OUTPUT_INDEX
from studio.web.points.clouds import PointClouds
from studio.web.points.maker import COLOURS
from studio.web.points.replayed import NO_DEPTH, ReplayedDepth
from studio.web.points.seen import DepthImages
from studio.web.scene.drawing import Drawing, DrawnStep, Look, Wanted
from studio.web.scene.gizmo import Gizmo
from studio.web.scene.operator import OperatorView
from studio.web.scene.performers.robot import ChosenRobot
from studio.web.scene.pins import PinMarks
from studio.web.scene.scene import LAYERS

_log = logging.getLogger(__name__)

DRAW_HZ = 30.0
AHEAD_S = 1.0 / 120.0
"""Time before the next picture of the live stage in which a newer step is awaited and drawn on arrival [s]."""

NEXT_STEP_S = 1.0 / 50.0
"""Time without a newer step after which a step that arrived during drawing is drawn [s]."""

TRAIL_JOINTS = ("LeftHand", "RightHand", "LeftFoot", "RightFoot")
MAX_TRAILS = 8


def _free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


class LiveView:
    """Draws results of the engine or the player, latest wins: `show` never waits for the browser.

    `look` returns the surroundings of the performer; it is called from the drawing thread. `depth` has the live
    stage's depth images. `clock` is the server's [s].

    Attributes:
        points: the clouds of the layer `points`.
        gizmo: the arrows by which a joint is dragged.
        pins: those of the replayed take.
    """

    def __init__(
        self, *, look: Look, depth: DepthImages, clock: Callable[[], float] = time.monotonic
    ) -> None:
        self.clock = clock
        with redirect_stdout(io.StringIO()):  # viser prints a banner with its loopback address
            self._server = viser.ViserServer(
                host="127.0.0.1", port=_free_port(), label="Stage", verbose=False
            )
        self._server.gui.configure_theme(show_logo=False, show_share_button=False)
        self._changed = threading.Condition()
        self._result: StepResult | None = None
        self._replay: DrawnStep | None = None
        self._fresh = self._clouds_fresh = False
        self._steps = 0
        self._layers = {name: shown for name, (_, shown) in LAYERS.items()}
        self._trail_joints = TRAIL_JOINTS
        self._operator: OperatorView | None = None
        self._operator_moved = False
        self._robot: ChosenRobot | None = None
        self._stopping = False
        self._drawing = Drawing(self._server, look)
        self.gizmo = Gizmo(self._server)
        self.pins = PinMarks(self._server)
        self.points = PointClouds(
            depth, watched=lambda: bool(self._server.get_clients()), changed=self._wake, clock=clock
        )
        self._thread = threading.Thread(target=self._run, name="view", daemon=True)
        self._thread.start()

    @property
    def port(self) -> int:
        """Loopback port of the viser server."""
        return self._server.get_port()

    @property
    def layers(self) -> dict[str, bool]:
        """Layer -> whether it is shown."""
        with self._changed:
            return dict(self._layers)

    @property
    def colours(self) -> dict[str, tuple[int, int, int]]:
        """Camera -> RGB colour."""
        return dict(self._drawing.scene.colours)

    @property
    def trail_joints(self) -> tuple[str, ...]:
        """Output joints with a trail."""
        with self._changed:
            return self._trail_joints

    @property
    def robot(self) -> ChosenRobot | None:
        """The robot that everybody is drawn as; None = a mannequin."""
        with self._changed:
            return self._robot

    def choose_robot(self, chosen: ChosenRobot | None) -> None:
        """Draw everybody as this robot, or as a mannequin (None)."""
        with self._changed:
            self._robot = chosen
            self._changed.notify()

    def show(self, result: StepResult) -> None:
        """Draw a live step after the last one; a newer one replaces it. Safe from any thread."""
        with self._changed:
            self._result = result
            self._steps += 1
            if self._replay is None:
                self.points.show(None, result)
                self._fresh = True
                self._changed.notify()

    def show_replay(
        self,
        result: StepResult,
        ghost: StepResult | None,
        trails: Mapping[int, NDArray[np.float64]],
        calibration: Calibration | None,
        depth: ReplayedDepth = NO_DEPTH,
        names: Mapping[int, str] = MappingProxyType({}),
        robots: tuple[str, Mapping[int, NDArray[np.float64]]] = ("", MappingProxyType({})),
    ) -> None:
        """Show a frame of a take instead of the live stage, until `show_live`; see `DrawnStep`. `depth`: where the
        take's depth images are; `robots`: a robot's name, and its configurations by the performer's number. Safe from
        any thread."""
        with self._changed:
            self._replay = DrawnStep(result, ghost, trails, calibration, names, robots[1], robots[0])
            self.gizmo.at(result.frame_set.stage_time_ns)
            self.points.show(depth, result)
            self._fresh = True
            self._changed.notify()

    def show_live(self) -> None:
        """Return to the live stage."""
        with self._changed:
            self._replay = self._result = None
            self.gizmo.at(None)
            self.pins.show(())
            self.points.show(None, None)
            self._changed.notify()

    def set_layers(self, layers: dict[str, bool]) -> None:
        """Show or hide layers (keys of `LAYERS`)."""
        with self._changed:
            self._layers.update(layers)
            self.points.choose(shown=self._layers["points"])
            self._changed.notify()

    def choose_points(self, colour: str | None, cameras: dict[str, bool]) -> None:
        """Change the points' colour (None: unchanged), show or hide some cameras'.

        Raises:
            SettingsError: no such colour or camera.
        """
        if colour is not None and colour not in COLOURS:
            raise SettingsError(bad_setting("colour", colour, COLOURS))
        known = {*self.points.status().cameras, *self.colours}
        unknown = [name for name in cameras if name not in known]
        if unknown:
            raise SettingsError(
                "view.camera",
                "camera {name!r} is not shown; allowed: {names}",
                name=unknown[0],
                names=", ".join(sorted(known)) or "none yet",
            )
        self.points.choose(colour=colour, cameras=cameras)

    def set_trail_joints(self, joints: list[str]) -> None:
        """Choose the output joints with a trail.

        Raises:
            SettingsError: no such joint, or more than `MAX_TRAILS`.
        """
        if len(joints) > MAX_TRAILS or any(name not in OUTPUT_INDEX for name in joints):
            raise SettingsError(
                "view.trails",
                "trails={joints} is not allowed; allowed: up to {most} of {allowed}",
                joints=",".join(joints),
                most=MAX_TRAILS,
                allowed=[*OUTPUT_INDEX],
            )
        with self._changed:
            self._trail_joints = tuple(joints)

    def show_operator(self, operator: OperatorView, *, moved: bool) -> int:
        """Take a page's viewpoint as the operator's view if the operator `moved` it, if it was that page's before, or
        if there was none; return the page whose viewpoint it is now."""
        with self._changed:
            if moved or self._operator is None or self._operator.page == operator.page:
                self._operator, self._operator_moved = operator, True
                self._changed.notify()
            return self._operator.page

    def forget_operator(self, page: int) -> None:
        """Remove the operator's view if it was that of this page, which was closed."""
        with self._changed:
            if self._operator is not None and self._operator.page == page:
                self._operator, self._operator_moved = None, True
                self._changed.notify()

    def _wake(self) -> None:
        """Draw again: there are new clouds."""
        with self._changed:
            self._clouds_fresh = True
            self._changed.notify()

    def close(self) -> None:
        """Stop drawing and close the viser server."""
        self.points.close()
        with self._changed:
            self._stopping = True
            self._changed.notify()
        self._thread.join(timeout=5.0)
        with redirect_stdout(io.StringIO()):  # and a line when it stops
            self._server.stop()

    def _run(self) -> None:
        problem = ""
        while (wanted := self._wait()) is not None:
            begun_s = self.clock()
            try:
                self._drawing.draw(wanted, begun_s)
                self._server.flush()  # viser would wait for more to send together
            except Exception as error:  # the view must not end because one frame could not be drawn
                if repr(error) != problem:  # an error of every frame is logged once
                    _log.exception("the 3D view could not draw a frame")
                problem = repr(error)
            pause_s = 1.0 / DRAW_HZ - (AHEAD_S if wanted.replay is None else 0.0)
            time.sleep(max(0.0, begun_s + pause_s - self.clock()))

    def _wait(self) -> Wanted | None:
        """Return the content to draw once it is new, or after a while; None at the end."""
        with self._changed:
            if self._fresh and self._replay is None:  # it arrived during the pause: a newer one follows soon
                steps = self._steps
                self._changed.wait_for(lambda: self._stopping or self._steps > steps, timeout=NEXT_STEP_S)
            self._changed.wait_for(
                lambda: self._stopping or self._fresh or self._clouds_fresh or self._operator_moved,
                timeout=0.2,
            )
            if self._stopping:
                return None
            fresh, self._fresh, self._clouds_fresh = self._fresh, False, False
            self._operator_moved = False
            live = self._result if fresh and self._replay is None else None
            return Wanted(
                live, self._replay, fresh, dict(self._layers), self._trail_joints, self._operator,
                self.points.newest, self._robot,
            )  # fmt: skip
