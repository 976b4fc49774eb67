"""A robot in the browser view: its bodies as rigid meshes."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import viser
from numpy.typing import NDArray
from viser._messages import SetOrientationMessage, SetPositionMessage

from studio.engine.model.frames import StepResult

if TYPE_CHECKING:
    from studio.engine.robots.body.robot import Robot
    from studio.engine.robots.body.shapes import Shape

DRAWN_S = 1.0 / 30.0
"""Usual time between drawn frames."""


@dataclass(frozen=True, eq=False)
class ChosenRobot:
    """A robot to draw in the performers' place, with its appearance."""

    robot: "Robot"
    shapes: "list[Shape]"


class RobotFigure:
    """One robot in the performer's place."""

    def __init__(
        self, server: viser.ViserServer, name: str, chosen: ChosenRobot, opacity: float | None
    ) -> None:
        import mujoco

        from studio.engine.robots.moving.stage_frames import StageFollower

        self.chosen = chosen
        self._scene = server.scene
        self._data = mujoco.MjData(chosen.robot.model)
        self._place = mujoco.mj_kinematics
        self._follower = StageFollower(chosen.robot, DRAWN_S)
        self._meshes = [
            server.scene.add_mesh_simple(
                f"{name}/{number}", shape.vertices_m, shape.triangles, color=shape.rgb, opacity=opacity,
                flat_shading=True,
            )
            for number, shape in enumerate(chosen.shapes)
        ]  # fmt: skip

    def draw(self, result: StepResult, q: NDArray[np.float64] | None) -> None:
        """Show a configuration, shape (nq,); None: the one in which the robot follows the performer live."""
        if q is None:
            q = self._followed(result)
        self._data.qpos[:] = q
        self._place(self.chosen.robot.model, self._data)
        queue = self._scene._queue_scene_message
        places, turns = self._data.xpos.tolist(), self._data.xquat.tolist()
        for mesh, shape in zip(self._meshes, self.chosen.shapes, strict=True):
            queue(SetPositionMessage(mesh.name, tuple(places[shape.body])))
            queue(SetOrientationMessage(mesh.name, tuple(turns[shape.body])))

    def _followed(self, result: StepResult) -> NDArray[np.float64]:
        if not (np.isfinite(result.positions_m).all() and np.isfinite(result.rotations_wxyz).all()):
            return self._follower.hold()
        return self._follower.follow(
            result.positions_m,
            result.rotations_wxyz,
            result.root_height_m,
            result.frame_set.stage_time_ns * 1e-9,
        )

    def set_opacity(self, opacity: float | None) -> None:
        """Make it transparent, or not (None)."""
        for mesh in self._meshes:
            if mesh.opacity != opacity:
                mesh.opacity = opacity

    def remove(self) -> None:
        """Remove it from the scene."""
        for mesh in self._meshes:
            mesh.remove()
