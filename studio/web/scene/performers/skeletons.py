"""Stick figures and trails of the browser view."""

import numpy as np
import viser
from numpy.typing import NDArray

from studio.engine.model.frames import FusedSkeleton
from studio.engine.model.joints import JOINT_COUNT, PARENTS
from studio.web.scene.balls import ball
from studio.web.scene.palette import FUSED_BONE_RGB, confidence_colours

_CHILDREN = np.flatnonzero(PARENTS >= 0)
_HIDDEN_M = 1e-5
_NO_POINTS = np.zeros((1, 3), dtype=np.float32)
_NO_BONES = np.zeros((1, 2, 3), dtype=np.float32)


def bones(positions: NDArray[np.float64]) -> NDArray[np.float32]:
    """Return the bones with both ends seen, shape (bone_count, 2, 3); positions (21, 3), NaN = unseen."""
    pairs = np.stack([positions[PARENTS[_CHILDREN]], positions[_CHILDREN]], axis=1)
    return pairs[np.isfinite(pairs).all(axis=(1, 2))].astype(np.float32)


class JointBalls:
    """Balls at canonical joints, hidden until they are drawn."""

    def __init__(self, server: viser.ViserServer, name: str, rgb: tuple[int, int, int]) -> None:
        vertices, faces = ball(9, 12)
        self._balls = server.scene.add_batched_meshes_simple(
            name,
            vertices,
            faces,
            batched_wxyzs=np.tile([1.0, 0.0, 0.0, 0.0], (JOINT_COUNT, 1)),
            batched_positions=np.zeros((JOINT_COUNT, 3)),
            batched_scales=np.full((JOINT_COUNT, 3), _HIDDEN_M),
            batched_colors=np.tile(np.array(rgb, dtype=np.uint8), (JOINT_COUNT, 1)),
            lod="off",
            cast_shadow=False,
        )

    def draw(
        self,
        joints_m: NDArray[np.float64],
        radii_m: NDArray[np.float64] | float,
        colours: NDArray[np.uint8] | None = None,
    ) -> None:
        """Show joints in the stage frame [m], shape (21, 3), NaN = left out; radii [m], shape (21,) or one for all;
        colours of each, shape (21, 3), or unchanged.
        """
        known = np.logical_and.reduce(np.isfinite(joints_m), axis=1)
        radii = np.where(known, radii_m, _HIDDEN_M)[:, None]
        self._balls.batched_positions = np.where(known[:, None], joints_m, 0.0)
        self._balls.batched_scales = np.repeat(radii, 3, axis=1)
        if colours is not None:
            self._balls.batched_colors = colours

    def hide(self) -> None:
        """Show nothing."""
        self._balls.batched_scales = np.full((JOINT_COUNT, 3), _HIDDEN_M)


class RawSkeleton:
    """One camera's skeleton as received: thin lines and points in the camera's colour."""

    def __init__(self, server: viser.ViserServer, name: str, rgb: tuple[int, int, int]) -> None:
        self._points = server.scene.add_point_cloud(
            f"{name}/points", _NO_POINTS, rgb, point_size=0.016, point_shape="circle", precision="float32",
            visible=False,
        )  # fmt: skip
        self._bones = server.scene.add_line_segments(
            f"{name}/bones", _NO_BONES, rgb, thickness=1.6, thickness_units="screen", visible=False
        )

    def draw(self, positions: NDArray[np.float64]) -> None:
        """Show canonical joints in the stage frame [m], shape (21, 3), NaN = unseen."""
        seen = positions[np.isfinite(positions).all(axis=1)].astype(np.float32)
        lines = bones(positions)
        self._points.visible = len(seen) > 0
        self._bones.visible = len(lines) > 0
        if len(seen):
            self._points.points = seen
        if len(lines):
            self._bones.points = lines

    def remove(self) -> None:
        """Remove it from the scene."""
        self._points.remove()
        self._bones.remove()


class FusedFigure:
    """The fused skeleton: joints as balls, larger and greener with certainty."""

    def __init__(self, server: viser.ViserServer, name: str) -> None:
        self._joints = JointBalls(server, f"{name}/joints", FUSED_BONE_RGB)
        self._bones = server.scene.add_line_segments(
            f"{name}/bones", _NO_BONES, FUSED_BONE_RGB, thickness=2.6, thickness_units="screen", visible=False
        )

    def draw(self, fused: FusedSkeleton) -> None:
        """Show a fused skeleton; joints that no camera sees are left out."""
        seen = np.isfinite(fused.positions).all(axis=1)
        confidence: NDArray[np.float64] = np.where(seen, np.nan_to_num(fused.confidence), 0.0)
        radii = 0.011 + 0.014 * np.round(confidence, 1)
        self._joints.draw(fused.positions, radii, confidence_colours(np.round(confidence, 1)))
        lines = bones(fused.positions)
        self._bones.visible = len(lines) > 0
        if len(lines):
            self._bones.points = lines


class Trail:
    """The path of one joint over the last seconds, as a line."""

    def __init__(self, server: viser.ViserServer, name: str, rgb: tuple[int, int, int]) -> None:
        self._line = server.scene.add_line_segments(
            name, _NO_BONES, rgb, thickness=2.2, thickness_units="screen", visible=False
        )

    def draw(self, path_m: NDArray[np.float64]) -> None:
        """Show a path [m], shape (point_count, 3); nothing for fewer than two points."""
        self._line.visible = len(path_m) > 1
        if len(path_m) > 1:
            self._line.points = np.stack([path_m[:-1], path_m[1:]], axis=1).astype(np.float32)
