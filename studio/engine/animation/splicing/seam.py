"""Seams between two parts of a performer's motion: the second is aligned with the first, and both are blended.

The second part is turned about the vertical and moved over the floor, as a whole, so that heading and place agree
over the seam on average. Within the seam every joint turns from one part to the other with continuous velocity and
acceleration, and feet move from one to the other in steps (`steps`).
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter1d, maximum_filter1d
from scipy.spatial.transform import Rotation

from studio.engine.animation.clip.foot_lock import LEGS, feet_of, stances_of, with_feet_moved
from studio.engine.animation.clip.kinematics import local_keys, world_poses
from studio.engine.animation.clip.resample import frames_of
from studio.engine.animation.splicing.steps import smooth_step, steps_between
from studio.engine.base.quaternions import continuous_signs
from studio.engine.model.poses import Poses

Array = NDArray[np.float64]

TURNING = ("Hips", "Spine2")
"""Joints whose mean heading is the body's, because hips and chest turn against each other in a walk."""

SAME_M = 1e-6

STRAIGHT = 0.985
"""Straightness that a leg needs to reach its foot's place, above which the hips are lowered."""

SMOOTH_S = 0.1

_LEG = ("UpLeg", "Leg", "Foot")


@dataclass(frozen=True)
class Piece:
    """A part of a motion with its feet.

    Attributes:
        poses: on the skeleton of the motion that they are spliced to, and aligned with it.
        feet: target places of the feet [m], shape (frame_count, 4, 3); None = the skeleton has no legs.
        stands: whether the left and the right foot stand, shape (frame_count, 2).
    """

    poses: Poses
    feet: Array | None
    stands: NDArray[np.bool_]

    @classmethod
    def of(cls, poses: Poses) -> "Piece":
        """Return poses on a uniform grid as a piece."""
        if not set(LEGS) <= set(poses.joint_names):
            return cls(poses, None, np.zeros((poses.frame_count, 2), dtype=bool))
        hold = stances_of(poses).hold > 0.0
        return cls(poses, feet_of(poses), hold[:, [0, 2]] | hold[:, [1, 3]])

    def part(self, rows: slice) -> "Piece":
        """Return some frames of the piece."""
        feet = None if self.feet is None else self.feet[rows]
        return Piece(frames_of(self.poses, rows), feet, self.stands[rows])


def put_on(first: Piece, second: Piece, count: int) -> Piece:
    """Return a second piece aligned with a first one, and on its bones: heading and place agree on average over the
    last `count` frames of the first and the first `count` of the second."""
    before, own = first.poses, second.poses
    angle = _heading(before, slice(-count, None)) - _heading(own, slice(count))
    turn = Rotation.from_rotvec([0.0, 0.0, angle])
    there = before.positions_m[-count:, 0].mean(axis=0)
    move = there - turn.apply(own.positions_m[:count, 0].mean(axis=0))
    move[2] = 0.0

    def placed(points: Array) -> Array:
        return turn.apply(points.reshape(-1, 3)).reshape(points.shape) + move

    quaternions = (turn * Rotation.from_quat(own.rotations_wxyz.reshape(-1, 4), scalar_first=True)).as_quat(
        scalar_first=True
    )
    positions, rotations = placed(own.positions_m), quaternions.reshape(own.rotations_wxyz.shape)
    poses = replace(own, positions_m=positions, rotations_wxyz=rotations, root_height_m=before.root_height_m)
    feet = None if second.feet is None else placed(second.feet)
    return Piece(_on_bones_of(before, poses, feet), feet, second.stands)


def _on_bones_of(other: Poses, poses: Poses, feet: Array | None) -> Poses:
    """Return poses with the bones of `other`, the hips as high as the feet's places need; the same object if the
    bones are equal."""
    offsets, local = local_keys(poses.parents, poses.positions_m, poses.rotations_wxyz)
    bones = np.median(local_keys(other.parents, other.positions_m, other.rotations_wxyz)[0], axis=0)
    if np.abs(np.median(offsets, axis=0) - bones)[1:].max(initial=0.0) < SAME_M:
        return poses
    offsets[:, 1:] = bones[1:]
    positions, rotations = world_poses(poses.parents, offsets, local)
    out = replace(poses, positions_m=positions, rotations_wxyz=rotations)
    if feet is None:
        return out
    positions[..., 2] -= np.median((feet_of(out) - feet)[:, [0, 2], 2])
    return replace(out, positions_m=positions)


def blended(first: Piece, second: Piece) -> Poses:
    """Return the seam of two pieces with equally many frames, the second aligned with the first."""
    count = first.poses.frame_count
    share = smooth_step(np.arange(1, count + 1) / (count + 1.0))
    keys = [
        local_keys(one.poses.parents, one.poses.positions_m, one.poses.rotations_wxyz)
        for one in (first, second)
    ]
    part = share[:, None, None]
    offsets = (1.0 - part) * keys[0][0] + part * keys[1][0]
    begin, end = (Rotation.from_quat(local.reshape(-1, 4), scalar_first=True) for _, local in keys)
    way = (begin.inv() * end).as_rotvec().reshape(count, -1, 3) * part
    local = (begin * Rotation.from_rotvec(way.reshape(-1, 3))).as_quat(scalar_first=True)
    local = continuous_signs(local.reshape(keys[0][1].shape))
    positions, rotations = world_poses(first.poses.parents, offsets, local)
    nearer = (share > 0.5)[:, None]
    poses = replace(
        first.poses,
        positions_m=positions,
        rotations_wxyz=rotations,
        confidence=np.where(nearer, second.poses.confidence, first.poses.confidence),
        uncertainty_mm=np.where(nearer, second.poses.uncertainty_mm, first.poses.uncertainty_mm),
    )
    if first.feet is None or second.feet is None:
        return poses
    dt = 1.0 / first.poses.frames_per_second
    feet = steps_between(first.feet, second.feet, (first.stands, second.stands), dt)
    straight = (1.0 - share[:, None]) * _straight(first.poses) + share[:, None] * _straight(second.poses)
    return with_feet_at(_lowered(poses, feet, straight), feet)


def with_feet_at(poses: Poses, feet: Array) -> Poses:
    """Return poses with feet at these places [m], shape (frame_count, 4, 3); the same object if they are there."""
    if np.abs(feet - feet_of(poses)).max(initial=0.0) < SAME_M:
        return poses
    return with_feet_moved(poses, feet - feet_of(poses), soft=False)


def _lowered(poses: Poses, feet: Array, straight: Array) -> Poses:
    """Return poses with the hips lowered as far as the legs need to reach the feet's places, smoothly over time.

    Args:
        poses: blended.
        feet: as in `Piece`.
        straight: straightness of the legs in the parts, shape (frame_count, 2); the limit if above `STRAIGHT`.
    """
    too_high = np.zeros(poses.frame_count)
    for k, (hip, _, length) in enumerate(_legs(poses)):
        reach = np.maximum(straight[:, k], STRAIGHT) * length
        flat = np.linalg.norm((feet[:, 2 * k] - hip)[:, :2], axis=1)
        reached = feet[:, 2 * k, 2] + np.sqrt(np.maximum(reach**2 - flat**2, 0.0))
        too_high = np.maximum(too_high, hip[:, 2] - reached)
    wide = max(1, round(SMOOTH_S * poses.frames_per_second))
    widest = maximum_filter1d(too_high, 2 * wide + 1, mode="constant")
    down = gaussian_filter1d(widest, 0.5 * wide, mode="constant")
    edge = np.minimum(np.arange(1, len(down) + 1), np.arange(len(down), 0, -1)) / (wide + 1.0)
    down = down * smooth_step(edge)
    return replace(poses, positions_m=poses.positions_m - down[:, None, None] * np.array([0.0, 0.0, 1.0]))


def _legs(poses: Poses) -> list[tuple[Array, Array, Array]]:
    """Hip and ankle of each leg [m], shape (frame_count, 3), and the leg's length when straight [m]."""
    out = []
    for side in ("Left", "Right"):
        hip, knee, ankle = (poses.positions_m[:, poses.joint_names.index(side + name)] for name in _LEG)
        out.append((hip, ankle, np.linalg.norm(knee - hip, axis=1) + np.linalg.norm(ankle - knee, axis=1)))
    return out


def _straight(poses: Poses) -> Array:
    """Straightness of the legs, 0..1, shape (frame_count, 2)."""
    return np.stack(
        [np.linalg.norm(ankle - hip, axis=1) / length for hip, ankle, length in _legs(poses)], axis=1
    )


def _heading(poses: Poses, rows: slice) -> float:
    """Mean angle about the vertical of hips and chest in some frames [rad]."""
    joints = [poses.joint_names.index(name) for name in TURNING if name in poses.joint_names]
    turned = poses.rotations_wxyz[rows][:, joints]
    angles = 2.0 * np.arctan2(turned[..., 3], turned[..., 0])
    return float(np.arctan2(np.sin(angles).mean(), np.cos(angles).mean()))
