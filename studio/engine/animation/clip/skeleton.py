"""Poses as a rest skeleton with local keys, in file axes.

Poses are world positions and rotations in the stage frame. A file holds a skeleton of constant offsets, whose
rest pose is the T-pose, and keys local to each joint's parent. `local_motion` turns one into the other, in the
axes of the files: y up, facing +z, so (x, y, z)file = (x, z, -y)stage.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from studio.engine.animation.clip.kinematics import check_poses, local_keys
from studio.engine.animation.clip.resample import resampled
from studio.engine.base.quaternions import IDENTITY, continuous_signs, inverse, multiply, rotate
from studio.engine.model.poses import Poses
from studio.engine.model.soles import rest_lift_m
from studio.engine.timecode.timecode import Timecode

OFFSET_TOLERANCE_M = 2e-5
"""A joint gets position keys if its offset differs from its median by more; a chain of 12 then errs under 0.25 mm."""


@dataclass(frozen=True)
class LocalMotion:
    """Poses as a skeleton with keys, in file axes (y up, facing +z) and metres.

    Attributes:
        joint_names: as in the file, shape (joint_count,).
        roles: the HumanIK name of each joint; "" for a bone without one (a root bone
            on the floor, an end of a chain, a target's helper bone).
        parents: index of each joint's parent, -1 for the only root, which is joint 0.
        frames_per_second: of the keys [Hz].
        offsets_m: rest position in the axes of the parent, shape (joint_count, 3); the root's is its rest
            position in file axes: over the origin, with the feet on the floor.
        rest_rotations_wxyz: world rotations of the rest pose, shape (joint_count, 4): each joint's own axes
            in the T-pose. The identity except for targets whose bones have their own axes.
        positions_m: joint index -> position keys in the parent's axes, shape (frame_count, 3), for every
            joint whose offset varies.
        rotations_wxyz: local rotations, from the joint's axes to its parent's, shape (frame_count,
            joint_count, 4), signs continuous over time.
        name: of the take.
        start_s: time of the first key [s]; 0 unless keys lie at a time of day.
        timecode: of the first key; None = not requested.
        undecided_s: spans [s from the first key] in which the performer's identity is uncertain; None = a single
            performer.
        between: the same motion with equal steps between the keys, if known and requested.
    """

    joint_names: tuple[str, ...]
    roles: tuple[str, ...]
    parents: NDArray[np.int64]
    frames_per_second: float
    offsets_m: NDArray[np.float64]
    rest_rotations_wxyz: NDArray[np.float64]
    positions_m: dict[int, NDArray[np.float64]]
    rotations_wxyz: NDArray[np.float64]
    name: str = "Take"
    start_s: float = 0.0
    timecode: Timecode | None = None
    undecided_s: tuple[tuple[float, float], ...] | None = None
    between: "LocalMotion | None" = None

    @property
    def frame_count(self) -> int:
        return len(self.rotations_wxyz)

    @property
    def rest_local_wxyz(self) -> NDArray[np.float64]:
        """Local rotations of the rest pose, shape (joint_count, 4)."""
        out = self.rest_rotations_wxyz.copy()
        below = np.flatnonzero(self.parents >= 0)
        above = inverse(self.rest_rotations_wxyz[self.parents[below]])
        out[below] = multiply(above, self.rest_rotations_wxyz[below])
        return out

    @property
    def rest_positions_m(self) -> NDArray[np.float64]:
        """World positions of the rest pose, shape (joint_count, 3)."""
        rest = self.offsets_m.copy()
        for joint, parent in enumerate(self.parents.tolist()):
            if parent >= 0:
                rest[joint] = rest[parent] + rotate(self.rest_rotations_wxyz[parent], rest[joint])
        return rest

    def local_positions_m(self) -> NDArray[np.float64]:
        """Position in the parent's axes at each key, shape (frame_count, joint_count, 3)."""
        out = np.repeat(self.offsets_m[None], self.frame_count, axis=0)
        for joint, keys in self.positions_m.items():
            out[:, joint] = keys
        return out


def with_keys_every(motion: LocalMotion, steps: int) -> LocalMotion:
    """Return the motion with a key every `steps` frames, and all frames in `between`."""
    if steps == 1:
        return motion
    whole = (motion.frame_count - 1) // steps * steps + 1
    dense = _at_frames(motion, slice(0, whole), 1)
    return replace(_at_frames(motion, slice(0, whole, steps), steps), between=dense)


def _at_frames(motion: LocalMotion, frames: slice, steps: int) -> LocalMotion:
    return replace(
        motion,
        frames_per_second=motion.frames_per_second / steps,
        positions_m={joint: keys[frames] for joint, keys in motion.positions_m.items()},
        rotations_wxyz=motion.rotations_wxyz[frames],
    )


def to_file_axes(vectors: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return stage vectors, shape (..., 3), in file axes: (x, z, -y)."""
    return np.stack([vectors[..., 0], vectors[..., 2], -vectors[..., 1]], axis=-1)


def rotations_to_file_axes(rotations_wxyz: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return rotations of stage vectors, shape (..., 4), as rotations of file vectors."""
    return np.concatenate([rotations_wxyz[..., :1], to_file_axes(rotations_wxyz[..., 1:])], axis=-1)


def local_motion(poses: Poses, *, fps: float | None = None) -> LocalMotion:
    """Return the poses as a rest skeleton with local keys, HumanIK names, hips at the root.

    Args:
        poses: of any skeleton with one root.
        fps: rate of the keys [Hz]; None keeps that of the poses.

    Raises:
        FormatError: as `check_poses`.
        SettingsError: fps is not in 0..1000.
    """
    check_poses(poses)
    poses, rate = resampled(poses, fps)
    keys, local = local_keys(poses.parents, poses.positions_m, poses.rotations_wxyz)
    offsets = np.median(keys, axis=0)
    offsets[0] = 0.0
    varies = np.linalg.norm(keys - offsets, axis=-1).max(axis=0) > OFFSET_TOLERANCE_M
    varies[0] = True
    joints = len(poses.parents)
    motion = LocalMotion(
        joint_names=poses.joint_names,
        roles=poses.joint_names,
        parents=poses.parents,
        frames_per_second=rate,
        offsets_m=to_file_axes(offsets),
        rest_rotations_wxyz=np.tile(IDENTITY, (joints, 1)),
        positions_m={int(j): to_file_axes(keys[:, j]) for j in np.flatnonzero(varies)},
        rotations_wxyz=rotations_to_file_axes(local),
    )
    motion.offsets_m[0, 1] += rest_lift_m(motion.rest_positions_m[:, 1], poses.root_height_m)
    return motion


def with_file_axes(motion: LocalMotion) -> LocalMotion:
    """Return the same motion with joints that have the file's axes in the rest pose."""
    rest = motion.rest_rotations_wxyz
    if np.abs(rest[:, 1:]).max() < 1e-9:
        return motion
    above = np.where(motion.parents[:, None] >= 0, rest[motion.parents], IDENTITY)
    rotations = multiply(multiply(above, motion.rotations_wxyz), inverse(rest))
    return replace(
        motion,
        offsets_m=rotate(above, motion.offsets_m),
        rest_rotations_wxyz=np.tile(IDENTITY, (len(rest), 1)),
        positions_m={joint: rotate(above[joint], keys) for joint, keys in motion.positions_m.items()},
        rotations_wxyz=continuous_signs(rotations),
    )


def end_sites(motion: LocalMotion) -> dict[int, NDArray[np.float64]]:
    """Return the end of each leaf bone, from the leaf in file axes in the rest pose [m]: index -> shape (3,).

    The head ends at its top, 11 % of the rest height above its joint; toes end forward. Any other leaf (a
    finger) continues its parent's direction, four fifths as long.
    """
    rest = motion.rest_positions_m
    leaves = set(range(len(motion.parents))) - set(motion.parents.tolist())
    ends = {}
    for joint in sorted(leaves):
        parent = motion.parents[joint]
        offset = rest[joint] - rest[parent] if parent >= 0 else np.zeros(3)
        length = float(np.linalg.norm(offset))
        if motion.roles[joint] == "Head":
            ends[joint] = np.array([0.0, 0.11 * rest[joint, 1], 0.0])
        elif motion.roles[joint].endswith("ToeBase"):
            ends[joint] = np.array([0.0, 0.0, max(0.45 * length, 0.01)])
        else:
            ends[joint] = 0.8 * offset if length > 0.005 else np.array([0.0, 0.03, 0.0])
    return ends
