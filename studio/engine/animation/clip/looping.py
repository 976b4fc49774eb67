"""Loops: find the best part of a clip to loop, and blend its end into its start."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from studio.engine.animation.clip.kinematics import Array, local_keys, world_poses
from studio.engine.base.errors import SettingsError
from studio.engine.base.quaternions import continuous_signs
from studio.engine.model.poses import Poses

LEAST_SHARE = 0.5
"""Shortest loop as a share of the clip, because standing still would loop best of all."""

LEAST_FRAMES = 8
BLEND_S = 0.4

CLOSED_M, CLOSED_DEG = 0.25, 30.0
"""A clip whose hips return to within this of place and heading ends exactly at its start; a travelling one keeps its
path."""

_VELOCITY_S = 0.3
_COARSE_FRAMES = 600
_UP = np.array([0.0, 0.0, 1.0])


def looped(poses: Poses, multiple: int = 1) -> Poses:
    """Return the best loop of the poses, whose last frame repeats the first.

    A travelling clip (a walk) ends in the first frame's pose at another place: only height, lean and limbs are
    blended.

    Args:
        poses: on a uniform grid, hips first.
        multiple: the number of steps is a multiple of this.

    Raises:
        SettingsError: the clip is too short.
    """
    if poses.frame_count < 2 * LEAST_FRAMES:
        raise SettingsError(
            "export.loop_short",
            "loop: the clip has {n} frames; allowed are {least} and more",
            n=poses.frame_count,
            least=2 * LEAST_FRAMES,
        )
    begin, end = best_loop(poses, multiple)
    frames = slice(begin, end + 1)
    offsets, local = local_keys(poses.parents, poses.positions_m[frames], poses.rotations_wxyz[frames])
    rate = poses.frames_per_second
    blend = _blend(len(local), round(BLEND_S * rate))
    root_m, root_turn = _closed_root(offsets[:, 0], local[:, 0])
    offsets = offsets + blend[:, None, None] * (offsets[0] - offsets[-1])
    offsets[:, 0] = poses.positions_m[frames, 0] + blend[:, None] * (root_m - poses.positions_m[end, 0])
    targets = local[0].copy()
    targets[0] = root_turn
    for joint in range(local.shape[1]):
        local[:, joint] = _turned_towards(local[:, joint], targets[joint], blend)
    positions, rotations = world_poses(poses.parents, offsets, continuous_signs(local))
    return replace(
        poses,
        time_s=poses.time_s[frames],
        positions_m=positions,
        rotations_wxyz=rotations,
        confidence=poses.confidence[frames],
        uncertainty_mm=poses.uncertainty_mm[frames],
    )


def best_loop(poses: Poses, multiple: int = 1) -> tuple[int, int]:
    """Return the first and last frame of the best loop, by similarity of pose and velocity."""
    features = features_of(poses)
    count = len(features)
    stride = max(1, count // _COARSE_FRAMES) * multiple
    places = np.arange(0, count, stride)
    begin, end = _most_alike(features, places, places, round(LEAST_SHARE * count), multiple)
    if stride == multiple:
        return begin, end
    near = np.arange(-stride, stride + 1, multiple)
    begins, ends = (np.unique(np.clip(middle + near, 0, count - 1)) for middle in (begin, end))
    return _most_alike(features, begins, ends, round(LEAST_SHARE * count), multiple)


def _most_alike(
    features: Array, begins: NDArray[np.int64], ends: NDArray[np.int64], least: int, multiple: int
) -> tuple[int, int]:
    a, b = features[begins], features[ends]
    cost = (a**2).sum(axis=1)[:, None] + (b**2).sum(axis=1) - 2 * a @ b.T
    length = ends[None] - begins[:, None]
    cost[(length < least) | (length % multiple > 0)] = np.inf
    i, j = np.unravel_index(np.argmin(cost), cost.shape)
    return int(begins[i]), int(ends[j])


def features_of(poses: Poses) -> Array:
    """Joints and their velocities relative to the hips' place on the floor and heading, shape (F, 6 J)."""
    place = poses.positions_m[:, :1] * [1.0, 1.0, 0.0]
    back = _heading(poses.rotations_wxyz[:, 0]).inv().as_matrix()
    joints = np.einsum("fij,fkj->fki", back, poses.positions_m - place)
    velocity = np.gradient(poses.positions_m, 1.0 / poses.frames_per_second, axis=0)
    moving = np.einsum("fij,fkj->fki", back, velocity)
    count = len(joints)
    return np.concatenate([joints.reshape(count, -1), _VELOCITY_S * moving.reshape(count, -1)], axis=1)


def _heading(hips_wxyz: Array) -> Rotation:
    """Return the turn about the vertical (z); the identity for hips that are upside down."""
    angles = 2.0 * np.arctan2(hips_wxyz[..., 3], hips_wxyz[..., 0])
    return Rotation.from_rotvec(np.multiply.outer(angles, _UP))


def _closed_root(root_m: Array, root_wxyz: Array) -> tuple[Array, Array]:
    """Return the hips' position and rotation at the end."""
    first, last = _heading(root_wxyz[0]), _heading(root_wxyz[-1])
    turn = last * first.inv()
    apart = np.linalg.norm((root_m[-1] - root_m[0])[:2])
    if apart < CLOSED_M and np.degrees(turn.magnitude()) < CLOSED_DEG:
        return root_m[0], root_wxyz[0]
    place = root_m[-1] * [1.0, 1.0, 0.0] + root_m[0] * _UP
    own = turn * Rotation.from_quat(root_wxyz[0], scalar_first=True)
    return place, own.as_quat(scalar_first=True)


def _turned_towards(local: Array, target: Array, blend: Array) -> Array:
    """Return rotations, shape (F, 4), that end at the target; `blend` spreads the difference at the end."""
    own = Rotation.from_quat(local, scalar_first=True)
    lacking = (own[-1].inv() * Rotation.from_quat(target, scalar_first=True)).as_rotvec()
    return (own * Rotation.from_rotvec(blend[:, None] * lacking)).as_quat(scalar_first=True)


def _blend(count: int, length: int) -> Array:
    """Return 0 to 1 over the last frames, without a kink at either end."""
    t = np.clip((np.arange(count) - (count - 1)) / max(1, min(length, count // 2)) + 1.0, 0.0, 1.0)
    return t * t * t * (10 + t * (6 * t - 15))
