"""All that is drawn of one performer: a part in every layer of the view."""

from collections.abc import Callable, Mapping

import numpy as np
import viser
from numpy.typing import NDArray

from studio.engine.model.frames import StepResult
from studio.engine.model.performers.colours import performer_colour
from studio.web.scene.palette import CAMERA_COLOURS
from studio.web.scene.performers.character import Character
from studio.web.scene.performers.effectors import EffectorMarks
from studio.web.scene.performers.ghost import Ghost
from studio.web.scene.performers.robot import ChosenRobot, RobotFigure
from studio.web.scene.performers.skeletons import FusedFigure, RawSkeleton, Trail

FIGURES = ("character", "fused", "raw", "effectors", "ghost", "trails")
"""Layers in which a performer has a part."""

BODY = ("character", "fused", "effectors", "trails")
"""Layers that show nothing without a solve."""

_NO_PATH = np.zeros((0, 3))

Shown = Callable[[str], bool]
"""Whether a layer is shown; nothing is drawn into a hidden one."""


class PerformerFigure:
    """One performer's parts; nodes are named after `performer`, for further ones after `performer_2` and so on.

    Args:
        server: the view's.
        number: of the performer, from 1.
    """

    def __init__(self, server: viser.ViserServer, number: int) -> None:
        own = "performer" if number == 1 else f"performer_{number}"
        self._server, self._own, self._number = server, own, number
        self._frames = {
            name: server.scene.add_frame(f"/{name}/{own}", show_axes=False, visible=False) for name in FIGURES
        }
        self._body = server.scene.add_frame(f"/character/{own}/body", show_axes=False)
        self._character = Character(server, f"/character/{own}/body")
        self._robot: RobotFigure | None = None
        self._opacity: float | None = None
        self._ghost = Ghost(server, f"/ghost/{own}")
        self._fused = FusedFigure(server, f"/fused/{own}/skeleton")
        self._effectors = EffectorMarks(server, f"/effectors/{own}/effectors")
        self._trails: list[Trail] = []
        self._raw: dict[str, RawSkeleton] = {}
        self._label: viser.LabelHandle | None = None
        self._name: str | None = None

    @property
    def stands_inside(self) -> bool:
        """Whether the second figure is a skeleton at the performer's place."""
        return self._ghost.stands_inside

    def call(self, name: str | None) -> None:
        """Show the performer in the colour of their number, with a name over the head; None: a single performer."""
        if name == self._name:
            return
        self._character.set_colour(None if name is None else performer_colour(self._number))
        self._name = name
        if self._label is not None:
            self._label.remove()
            self._label = None
        if name is not None:
            self._label = self._server.scene.add_label(
                f"/character/{self._own}/name", name, anchor="bottom-center"
            )

    def draw(
        self,
        result: StepResult,
        ghost: StepResult | None,
        *,
        shown: Shown,
        colours: Mapping[str, tuple[int, int, int]],
        name_at: NDArray[np.float64] | None = None,
        robot_q: NDArray[np.float64] | None = None,
    ) -> None:
        """Show the performer's step, and a second figure next to it.

        Args:
            result: the step.
            ghost: of the second figure.
            shown: returns whether a layer is shown.
            colours: of the cameras.
            name_at: place of the name [m], shape (3,).
            robot_q: configuration of the robot that is drawn, if any; None: it follows the step.
        """
        body = bool(np.isfinite(result.positions_m[0]).all())
        if shown("raw"):
            self._draw_raw(result, colours)
        if shown("fused"):
            self._fused.draw(result.fused)
        if shown("effectors") and body:
            self._effectors.draw(result)
        if shown("character") and body:
            if self._robot is None:
                self._character.draw(result)
            else:
                self._robot.draw(result, robot_q)
            if self._label is not None and name_at is not None:
                self._label.position = name_at.round(3)
        self._ghost.draw(ghost, result.positions_m[0])
        for name, frame in self._frames.items():
            frame.visible = (name != "ghost" or ghost is not None) and (body or name not in BODY)

    def _draw_raw(self, result: StepResult, colours: Mapping[str, tuple[int, int, int]]) -> None:
        cameras = result.frame_set.cameras
        for name, positions in zip(cameras, result.frame_set.positions, strict=True):
            if name not in self._raw:
                self._raw[name] = RawSkeleton(self._server, f"/raw/{self._own}/{name}", colours[name])
            self._raw[name].draw(positions)
        self.keep_raw(cameras)

    def keep_raw(self, cameras: tuple[str, ...] | list[str]) -> None:
        """Remove the skeletons of all cameras but these."""
        for name in [name for name in self._raw if name not in cameras]:
            self._raw.pop(name).remove()

    def draw_trails(self, paths_m: NDArray[np.float64]) -> None:
        """Show earlier places of joints, shape (frame_count, joint_count, 3), the newest last."""
        count = paths_m.shape[1]
        while len(self._trails) < count:
            colour = CAMERA_COLOURS[len(self._trails) % len(CAMERA_COLOURS)]
            self._trails.append(Trail(self._server, f"/trails/{self._own}/{len(self._trails)}", colour))
        for i, trail in enumerate(self._trails):
            trail.draw(paths_m[:, i] if i < count else _NO_PATH)

    def set_opacity(self, opacity: float | None) -> None:
        """Make the body transparent, or not (None)."""
        self._opacity = opacity
        self._character.set_opacity(opacity)
        if self._robot is not None:
            self._robot.set_opacity(opacity)

    def use_robot(self, chosen: ChosenRobot | None) -> None:
        """Draw a robot in place of the mannequin, or the mannequin (None)."""
        if (None if self._robot is None else self._robot.chosen) is chosen:
            return
        if self._robot is not None:
            self._robot.remove()
        self._robot = (
            None
            if chosen is None
            else RobotFigure(self._server, f"/character/{self._own}/robot", chosen, self._opacity)
        )
        self._body.visible = chosen is None

    def hide(self) -> None:
        """Hide the performer, whom no camera has seen for a while."""
        for frame in self._frames.values():
            frame.visible = False
