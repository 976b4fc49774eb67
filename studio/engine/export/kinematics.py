"""World poses from and to keys local to each joint's parent, for all frames at once."""

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from studio.engine.errors import FormatError
from studio.engine.poses import Poses

Array = NDArray[np.float64]


def local_keys(parents: NDArray[np.int64], positions: Array, rotations_wxyz: Array) -> tuple[Array, Array]:
    """Return offsets from the parents in the parents' axes (F, J, 3) and local rotations (F, J, 4).

    Args:
        parents: index of each joint's parent, -1 for a root, whose keys stay those of the world.
        positions: world positions, shape (frame_count, joint_count, 3).
        rotations_wxyz: world rotations, shape (frame_count, joint_count, 4), of any length but 0.

    The signs of the quaternions are continuous over time.
    """
    world = [Rotation.from_quat(rotations_wxyz[:, j], scalar_first=True) for j in range(len(parents))]
    offsets, local = np.empty_like(positions), np.empty_like(rotations_wxyz)
    for joint, parent in enumerate(parents):
        if parent < 0:
            offsets[:, joint], own = positions[:, joint], world[joint]
        else:
            to_parent = world[parent].inv()
            offsets[:, joint] = to_parent.apply(positions[:, joint] - positions[:, parent])
            own = to_parent * world[joint]
        local[:, joint] = own.as_quat(scalar_first=True)
    return offsets, continuous_signs(local)


def world_poses(parents: NDArray[np.int64], offsets: Array, local_wxyz: Array) -> tuple[Array, Array]:
    """Return world positions (F, J, 3) and rotations (F, J, 4): the inverse of `local_keys`."""
    positions, rotations = np.empty_like(offsets), np.empty_like(local_wxyz)
    world: list[Rotation] = []
    for joint, parent in enumerate(parents):
        own = Rotation.from_quat(local_wxyz[:, joint], scalar_first=True)
        if parent < 0:
            positions[:, joint] = offsets[:, joint]
        else:
            positions[:, joint] = positions[:, parent] + world[parent].apply(offsets[:, joint])
            own = world[parent] * own
        world.append(own)
        rotations[:, joint] = own.as_quat(scalar_first=True)
    return positions, rotations


def continuous_signs(quaternions_wxyz: Array) -> Array:
    """Return quaternions, shape (frame_count, ..., 4), each on the half-sphere of the one before."""
    dots = (quaternions_wxyz[1:] * quaternions_wxyz[:-1]).sum(axis=-1)
    signs = np.cumprod(np.where(dots < 0, -1.0, 1.0), axis=0)
    out = quaternions_wxyz.copy()
    out[1:] *= signs[..., None]
    return out


def normalized(quaternions_wxyz: Array) -> Array:
    return quaternions_wxyz / np.linalg.norm(quaternions_wxyz, axis=-1, keepdims=True)


def check_poses(poses: Poses) -> None:
    """Refuse poses that no file can hold.

    Raises:
        FormatError: no frame, more than one root, values that are not finite, a rotation of no length, or
            times that do not increase.
    """
    if poses.frame_count == 0:
        raise FormatError("poses: no frame to export; solve a take that has frames")
    if (poses.parents < 0).sum() != 1 or poses.parents[0] >= 0:
        raise FormatError(f"poses: {(poses.parents < 0).sum()} joints have no parent; export needs one root")
    if not (np.isfinite(poses.positions_m).all() and np.isfinite(poses.rotations_wxyz).all()):
        raise FormatError("poses: positions and rotations must be finite; solve the take again")
    if np.linalg.norm(poses.rotations_wxyz, axis=-1).min() < 1e-6:
        raise FormatError("poses: a rotation is a quaternion of no length; solve the take again")
    if not np.isfinite(poses.time_s).all() or (poses.frame_count > 1 and np.diff(poses.time_s).min() <= 0):
        raise FormatError("poses: the times of the frames do not increase; solve the take again")
