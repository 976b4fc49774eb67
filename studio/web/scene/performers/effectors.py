"""The solve's targets: a marker per joint, with a line to the solved joint, and the head's look."""

import numpy as np
import viser
from numpy.typing import NDArray

from studio.engine.base.geometry import matrices
from studio.engine.model.frames import StepResult
from studio.engine.model.joints import JOINT_COUNT, OUTPUT_INDEX, OUTPUT_OF_CANONICAL_INDEX
from studio.web.scene.balls import ball
from studio.web.scene.palette import EFFECTOR_RGB, GAZE_RGB

_HEAD = OUTPUT_INDEX["Head"]
_EYES_M = np.array([0.0, -0.09, 0.07])
_GAZE_M = 0.9
_TARGET_M = 0.017
_NO_LINES = np.zeros((1, 2, 3), dtype=np.float32)


def gaze_line(positions_m: NDArray[np.float64], rotations_wxyz: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the start of the head's look and a second point on it, stage frame [m], shape (2, 3)."""
    turn = matrices(rotations_wxyz[_HEAD])
    eyes = positions_m[_HEAD] + turn @ _EYES_M
    return np.stack([eyes, eyes + turn @ np.array([0.0, -_GAZE_M, 0.0])])


class EffectorMarks:
    """Targets as small diamonds, residuals as lines, the look as a line with a ball."""

    def __init__(self, server: viser.ViserServer, name: str) -> None:
        diamond, faces = ball(3, 4)
        round_one, round_faces = ball(9, 12)
        self._targets = server.scene.add_batched_meshes_simple(
            f"{name}/targets",
            diamond,
            faces,
            batched_wxyzs=np.tile([1.0, 0.0, 0.0, 0.0], (JOINT_COUNT, 1)),
            batched_positions=np.zeros((JOINT_COUNT, 3)),
            batched_scales=np.full((JOINT_COUNT, 3), 1e-5),
            batched_colors=np.array(EFFECTOR_RGB, dtype=np.uint8),
            flat_shading=True,
            lod="off",
            cast_shadow=False,
        )
        self._misses = server.scene.add_line_segments(
            f"{name}/misses", _NO_LINES, EFFECTOR_RGB, thickness=2.0, thickness_units="screen", visible=False
        )
        self._look = server.scene.add_line_segments(
            f"{name}/look", _NO_LINES, GAZE_RGB, thickness=1.6, thickness_units="screen"
        )
        self._looked_at = server.scene.add_mesh_simple(
            f"{name}/looked_at", 0.022 * round_one, round_faces, color=GAZE_RGB,
            cast_shadow=False,
        )  # fmt: skip

    def draw(self, result: StepResult) -> None:
        """Show the targets of one step, without unknown ones."""
        targets = result.fused.positions
        known = np.logical_and.reduce(np.isfinite(targets), axis=1)
        joints = result.positions_m[OUTPUT_OF_CANONICAL_INDEX]
        size = np.where(known, _TARGET_M, 1e-5)
        self._targets.batched_positions = np.where(known[:, None], targets, 0.0)
        self._targets.batched_scales = np.repeat(size[:, None], 3, axis=1)
        self._misses.visible = bool(known.any())
        if known.any():
            self._misses.points = np.stack([targets[known], joints[known]], axis=1).astype(np.float32)
        line = gaze_line(result.positions_m, result.rotations_wxyz)
        self._look.points = line[None].astype(np.float32)
        self._looked_at.position = line[1]
