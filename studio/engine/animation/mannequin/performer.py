"""The mannequin of a performer: in the stage's axes, with the proportions of poses of the output skeleton."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from studio.engine.animation.mannequin.body import mannequin_mesh
from studio.engine.animation.mannequin.mesh import SkinnedMesh
from studio.engine.base.geometry import matrices
from studio.engine.model.joints import OUTPUT_JOINTS, OUTPUT_PARENTS
from studio.engine.model.performers.bodies import BODIES
from studio.engine.model.poses import Poses
from studio.engine.model.soles import rest_lift_m

Array = NDArray[np.float64]

_CHILDREN = np.flatnonzero(OUTPUT_PARENTS >= 0)
_TO_STAGE = np.array([1.0, -1.0, 1.0], dtype=np.float32)
_CARRIED_M = 1e-4
_LOOKED_AT = 200
"""Number of frames from which bones are measured."""


def bone_offsets(positions_m: Array, rotations_wxyz: Array) -> Array:
    """Return each joint's position in its parent's axes [m], shape (..., 52, 3); the root at 0.

    Args:
        positions_m: output joints in the stage frame, shape (..., 52, 3).
        rotations_wxyz: their world rotations, shape (..., 52, 4).
    """
    parents = OUTPUT_PARENTS[_CHILDREN]
    along = positions_m[..., _CHILDREN, :] - positions_m[..., parents, :]
    turns = matrices(rotations_wxyz)[..., parents, :, :]
    offsets = np.zeros_like(positions_m)
    offsets[..., _CHILDREN, :] = np.einsum("...jik,...ji->...jk", turns, along)
    return offsets


def rest_positions(offsets_m: Array) -> Array:
    """Return the joints in the T-pose, stage axes, hips at 0 [m], shape (52, 3)."""
    rest = offsets_m.copy()
    for joint in _CHILDREN:  # parents come first
        rest[joint] += rest[OUTPUT_PARENTS[joint]]
    return rest


def stage_mesh(rest_m: Array, root_height_m: float | None = None, *, body: str = BODIES[0]) -> SkinnedMesh:
    """Return one of `BODIES` for output joints in the T-pose, in the stage's axes.

    Args:
        rest_m: the joints, hips at 0, shape (52, 3).
        root_height_m: of the hips above the floor; None = the toes' joints are at a usual height.
        body: its name.

    Raises:
        FormatError: no body fits such bones.
    """
    floor_m = -rest_lift_m(rest_m[:, 2], root_height_m)
    mesh = mannequin_mesh(
        _present(rest_m), rest_m[:, [0, 2, 1]] * [1.0, 1.0, -1.0], floor_m=floor_m, body=body
    )
    vertices, normals = (values[:, [0, 2, 1]] * _TO_STAGE for values in (mesh.vertices_m, mesh.normals))
    return replace(mesh, vertices_m=vertices, normals=normals)


def _present(rest_m: Array) -> list[str]:
    """Return the joints' roles, "" for one at its parent's place, where an animation that lacks it carries it."""
    apart = np.linalg.norm(rest_m - rest_m[OUTPUT_PARENTS], axis=1) > _CARRIED_M
    return [
        name if there or parent < 0 else ""
        for name, there, parent in zip(OUTPUT_JOINTS, apart, OUTPUT_PARENTS, strict=True)
    ]


@dataclass(frozen=True)
class Mannequin:
    """A performer's mannequin, posed by `posed`.

    Attributes:
        mesh: in the T-pose, stage axes.
        rest_m: the output joints there, shape (52, 3).
    """

    mesh: SkinnedMesh
    rest_m: Array

    @classmethod
    def of(cls, poses: Poses, body: str = BODIES[0]) -> "Mannequin":
        """Return one of `BODIES` for poses of the output skeleton, from the medians of their bones.

        Raises:
            FormatError: as `stage_mesh`.
        """
        some = slice(None, None, max(1, poses.frame_count // _LOOKED_AT))
        rest_m = rest_positions(
            np.median(bone_offsets(poses.positions_m[some], poses.rotations_wxyz[some]), axis=0)
        )
        return cls(stage_mesh(rest_m, poses.root_height_m, body=body), rest_m)

    def posed(self, positions_m: Array, rotations_wxyz: Array) -> tuple[Array, Array]:
        """Return vertices [m] and unit normals in a pose, stage frame, shapes (V, 3).

        Args:
            positions_m: output joints in the stage frame, shape (52, 3).
            rotations_wxyz: their world rotations, shape (52, 4).
        """
        turns = matrices(rotations_wxyz)
        return self.mesh.posed(self.rest_m, positions_m, turns), self.mesh.posed_normals(turns)
