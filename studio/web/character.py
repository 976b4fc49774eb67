"""The solved character in the browser view: the mannequin of `studio.render.body` as batched meshes."""

import numpy as np
import viser
from numpy.typing import NDArray

from studio.render import shapes
from studio.render.body import JOINT, PARTS, body_scale, place
from studio.web.palette import BODY_RGB, JOINT_RGB

OPACITY = 0.7
"""Below 1, so that the skeletons inside the body can be seen."""

_ROUNDING = 4  # decimals of lengths [m]: a bone that does not change is not sent again
_SCALE_MEMORY = 0.98  # share of the old body scale kept per frame


class Character:
    """One mannequin: a batch of instances per unit shape, so that a pose is a few messages."""

    def __init__(
        self,
        server: viser.ViserServer,
        name: str,
        *,
        tint: tuple[int, int, int] | None = None,
        opacity: float = OPACITY,
    ) -> None:
        self._scale: float | None = None
        self._rows: list[NDArray[np.int64]] = []
        self._batches: list[viser.BatchedMeshHandle] = []
        for shape in shapes.SHAPES:
            rows = np.array([i for i, part in enumerate(PARTS) if part.shape == shape])
            fine = shape in ("chest", "pelvis", "head", "limb")
            vertices, faces = shapes.mesh(shape, 19 if fine else 13, 24 if fine else 16)
            colours = [tint or (JOINT_RGB if PARTS[i].tone == JOINT else BODY_RGB) for i in rows]
            self._rows.append(rows)
            self._batches.append(
                server.scene.add_batched_meshes_simple(
                    f"{name}/{shape}",
                    vertices,
                    faces,
                    batched_wxyzs=np.tile([1.0, 0.0, 0.0, 0.0], (len(rows), 1)),
                    batched_positions=np.zeros((len(rows), 3)),
                    batched_scales=np.full((len(rows), 3), 1e-4),
                    batched_colors=np.array(colours, dtype=np.uint8),
                    lod="off",
                    opacity=opacity,
                )
            )

    def draw(self, positions_m: NDArray[np.float64], rotations_wxyz: NDArray[np.float64]) -> None:
        """Show a pose of the output skeleton: positions (52, 3) in the stage frame, rotations (52, 4)."""
        scale = body_scale(positions_m)
        self._scale = (
            scale if self._scale is None else _SCALE_MEMORY * self._scale + (1 - _SCALE_MEMORY) * scale
        )
        placement = place(positions_m, rotations_wxyz, round(self._scale, 2))
        wxyz = placement.wxyz.astype(np.float32)
        positions = placement.positions_m.astype(np.float32)
        scales = np.round(placement.scales_m, _ROUNDING).astype(np.float32)
        for rows, batch in zip(self._rows, self._batches, strict=True):
            batch.batched_positions = positions[rows]
            batch.batched_wxyzs = wxyz[rows]
            batch.batched_scales = scales[rows]
