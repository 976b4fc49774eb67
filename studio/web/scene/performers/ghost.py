"""The second figure of a replay: a tinted character, or a skeleton if only joints are known."""

import numpy as np
import viser

from studio.engine.model.frames import StepResult
from studio.web.scene.palette import GHOST_OPACITY, GHOST_RGB
from studio.web.scene.performers.character import Character
from studio.web.scene.performers.skeletons import JointBalls, bones

_JOINT_RADIUS_M = 0.021
_INSIDE_M = 0.4
_NO_BONES = np.zeros((1, 2, 3), dtype=np.float32)


class JointFigure:
    """Joints as balls and bones as lines, in the ghost's colour."""

    def __init__(self, server: viser.ViserServer, name: str) -> None:
        self._joints = JointBalls(server, f"{name}/joints", GHOST_RGB)
        self._bones = server.scene.add_line_segments(
            f"{name}/bones", _NO_BONES, GHOST_RGB, thickness=4.0, thickness_units="screen", visible=False
        )

    def draw(self, joints_m: np.ndarray) -> None:
        """Show canonical joints in the stage frame [m], shape (21, 3); NaN = unknown, and left out."""
        self._joints.draw(joints_m, _JOINT_RADIUS_M)
        lines = bones(joints_m)
        self._bones.visible = len(lines) > 0
        if len(lines):
            self._bones.points = lines

    def hide(self) -> None:
        """Show nothing."""
        self._joints.hide()
        self._bones.visible = False


class Ghost:
    """The second figure; its parts are made on demand."""

    def __init__(self, server: viser.ViserServer, name: str) -> None:
        self._server, self._name = server, name
        self._body_frame = server.scene.add_frame(f"{name}/body", show_axes=False)
        self._body: Character | None = None
        self._figure: JointFigure | None = None
        self.stands_inside = False
        """Whether it is a skeleton at the performer's place."""

    def draw(self, result: StepResult | None, hips_m: np.ndarray) -> None:
        """Show a character, or the joints of `fused` if `positions_m` is NaN; None: nobody.

        `hips_m`: the first figure's hips, shape (3,).
        """
        if result is None:
            self.stands_inside = False
            return
        as_body = bool(np.isfinite(result.positions_m).all())
        away_m = np.linalg.norm((result.fused.positions - hips_m)[:, :2], axis=1)
        self.stands_inside = not as_body and bool((away_m < _INSIDE_M).any())
        self._body_frame.visible = as_body
        if as_body:
            if self._body is None:
                self._body = Character(
                    self._server, f"{self._name}/body/character", tint=GHOST_RGB, opacity=GHOST_OPACITY
                )
            self._body.draw(result)
            if self._figure is not None:
                self._figure.hide()
            return
        if self._figure is None:
            self._figure = JointFigure(self._server, f"{self._name}/joints")
        self._figure.draw(result.fused.positions)
