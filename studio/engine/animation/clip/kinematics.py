"""Conversion of world poses to and from keys local to each joint's parent, for all frames at once."""

import numpy as np
from numpy.typing import NDArray

from studio.engine.base.errors import FormatError
from studio.engine.base.quaternions import continuous_signs, inverse, multiply, normalized, rotate
from studio.engine.model.poses import Poses

Array = NDArray[np.float64]


def local_keys(parents: NDArray[np.int64], positions: Array, rotations_wxyz: Array) -> tuple[Array, Array]:
    """Return offsets from the parents in the parents' axes (F, J, 3) and local rotations (F, J, 4).

    Args:
        parents: index of each joint's parent, -1 for a root, whose keys stay those of the world.
        positions: world positions, shape (frame_count, joint_count, 3).
        rotations_wxyz: world rotations, shape (frame_count, joint_count, 4), of any length but 0.

    The signs of the quaternions are continuous over time.
    """
    world = normalized(rotations_wxyz)
    offsets, local = positions.copy(), world.copy()
    below = np.flatnonzero(parents >= 0)
    above = parents[below]
    to_parent = inverse(world[:, above])
    offsets[:, below] = rotate(to_parent, positions[:, below] - positions[:, above])
    local[:, below] = multiply(to_parent, world[:, below])
    return offsets, continuous_signs(local)


def world_poses(parents: NDArray[np.int64], offsets: Array, local_wxyz: Array) -> tuple[Array, Array]:
    """Return world positions (F, J, 3) and rotations (F, J, 4): the inverse of `local_keys`."""
    positions, rotations = offsets.copy(), local_wxyz.copy()
    for joint, parent in enumerate(parents.tolist()):
        if parent >= 0:
            positions[:, joint] = positions[:, parent] + rotate(rotations[:, parent], offsets[:, joint])
            rotations[:, joint] = multiply(rotations[:, parent], local_wxyz[:, joint])
    return positions, rotations


def check_poses(poses: Poses) -> None:
    """Refuse poses that no file can hold.

    Raises:
        FormatError: no frame, more than one root, values that are not finite, a rotation of length zero, or
            times that do not increase.
    """
    if poses.frame_count == 0:
        raise FormatError("export.no_frame", "poses: no frame to export; solve a take that has frames")
    if (poses.parents < 0).sum() != 1 or poses.parents[0] >= 0:
        raise FormatError(
            "export.roots",
            "poses: {n} joints have no parent; export needs one root",
            n=(poses.parents < 0).sum(),
        )
    if not (np.isfinite(poses.positions_m).all() and np.isfinite(poses.rotations_wxyz).all()):
        raise FormatError(
            "export.not_finite", "poses: positions and rotations must be finite; solve the take again"
        )
    if np.linalg.norm(poses.rotations_wxyz, axis=-1).min() < 1e-6:
        raise FormatError(
            "export.no_rotation", "poses: a rotation is a quaternion of no length; solve the take again"
        )
    if not np.isfinite(poses.time_s).all() or (poses.frame_count > 1 and np.diff(poses.time_s).min() <= 0):
        raise FormatError(
            "export.times", "poses: the times of the frames do not increase; solve the take again"
        )
