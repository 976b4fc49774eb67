"""Poses as labelled points: the joint centres, and the surface markers of a laboratory (`mannequin.markers`).

A point whose joint no camera sees (confidence 0) is a gap.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from studio.engine.animation.clip.kinematics import check_poses
from studio.engine.animation.clip.skeleton import local_motion
from studio.engine.animation.mannequin import mannequin_mesh
from studio.engine.animation.mannequin.markers import markers
from studio.engine.base.errors import FormatError
from studio.engine.base.geometry import matrices
from studio.engine.model.joints import OUTPUT_OF_CANONICAL
from studio.engine.model.poses import Poses

CANONICAL_OF_OUTPUT: dict[str, str] = {output: name for name, output in OUTPUT_OF_CANONICAL.items()}


@dataclass(frozen=True)
class LabelledPoints:
    """Labelled points over time, in the stage frame.

    Attributes:
        labels: a joint centre's canonical name, or its own name without one; then Plug-in Gait's.
        positions_m: shape (frame_count, point_count, 3); NaN = a gap.
        radius_mm: of the 90 % ball, shape (frame_count, point_count); NaN = not measured.
    """

    labels: tuple[str, ...]
    positions_m: NDArray[np.float64]
    radius_mm: NDArray[np.float64]


def joint_labels(poses: Poses) -> tuple[str, ...]:
    """Return a label per joint: its canonical name, or its own name without one."""
    return tuple(CANONICAL_OF_OUTPUT.get(name, name) for name in poses.joint_names)


def points_of(poses: Poses) -> LabelledPoints:
    """Return joint centres and surface markers; fingers are left out.

    Raises:
        FormatError: poses that cannot be exported, or a skeleton that lacks hips, head or a limb.
    """
    check_poses(poses)
    rest = local_motion(poses).rest_positions_m
    mesh = mannequin_mesh(poses.joint_names, rest, floor_m=0.0)
    found = markers(mesh, poses.joint_names, rest, floor_m=0.0)
    labels = joint_labels(poses)
    centres = [
        joint for joint, label in enumerate(labels) if label in OUTPUT_OF_CANONICAL or "Hand" not in label
    ]
    carriers = [marker.joint for marker in found]
    offsets = _from_file_axes(np.array([marker.offset_m for marker in found]))
    turned = np.einsum("fmij,mj->fmi", matrices(poses.rotations_wxyz[:, carriers]), offsets)
    positions = np.concatenate(
        [poses.positions_m[:, centres], poses.positions_m[:, carriers] + turned], axis=1
    )
    follows = centres + carriers
    positions[poses.confidence[:, follows] <= 0.0] = np.nan
    if not np.isfinite(positions).any():
        raise FormatError(
            "export.no_point", "poses: no camera sees any joint in any frame, so there is no point to write"
        )
    return LabelledPoints(
        labels=tuple(labels[joint] for joint in centres) + tuple(marker.name for marker in found),
        positions_m=positions,
        radius_mm=poses.uncertainty_mm[:, follows],
    )


def _from_file_axes(vectors: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return file vectors, shape (..., 3), in stage axes; the inverse of `skeleton.to_file_axes`."""
    return vectors[..., [0, 2, 1]] * [1.0, -1.0, 1.0]
