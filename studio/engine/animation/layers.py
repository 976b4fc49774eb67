"""Edits of a solve's poses: joints turned further, the body moved, head and palms turned to directions.

All are eased in and out, and bones keep their lengths. Turns to a direction stay within a neck's and a wrist's range.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from studio.engine.animation.clip.kinematics import local_keys, world_poses
from studio.engine.base.quaternions import inverse, multiply, rotate
from studio.engine.edits.edit import DirectionEdit, Edit, OffsetEdit
from studio.engine.edits.timing import of_kind, share
from studio.engine.model.poses import Poses

Array = NDArray[np.float64]

HEAD_FORWARD = np.array([0.0, -1.0, 0.0])
PALM_OUT = np.array([0.0, 0.0, -1.0])
"""Directions of the head and of the palms in the T-pose."""

NECK_SHARE = 0.4
"""Share of a turn of the head that the neck makes."""

FOREARM_SHARE = 0.5
"""Share of a twist of the hand that the forearm makes."""

MOST_HEAD_DEG, MOST_TWIST_DEG, MOST_WRIST_DEG = 80.0, 90.0, 60.0
"""Largest turns to a direction."""


def with_layers(poses: Poses, edits: Sequence[Edit]) -> Poses:
    """Return poses with the directions and offsets of edits, in this order; without any the same object.

    Args:
        poses: of the output skeleton.
        edits: of its performer; other kinds, and joints that the poses lack, are ignored.
    """
    directions = of_kind(edits, DirectionEdit)
    offsets = [one for one in of_kind(edits, OffsetEdit) if one.joint in poses.joint_names]
    if not directions and not offsets:
        return poses
    steps, local = local_keys(poses.parents, poses.positions_m, poses.rotations_wxyz)
    for direction in directions:
        _turn_to(direction, poses, steps, local)
    for offset in offsets:
        told = share(offset, poses.time_s)[:, None]
        joint = poses.joint_names.index(offset.joint)
        turn = Rotation.from_rotvec(np.radians(offset.rotation_deg) * told).as_quat(scalar_first=True)
        local[:, joint] = multiply(local[:, joint], turn)
        if offset.joint == "Hips":
            steps[:, joint] += told * np.array(offset.move_m)
    positions, rotations = world_poses(poses.parents, steps, local)
    return replace(poses, positions_m=positions, rotations_wxyz=rotations)


def missed_deg(edit: DirectionEdit, poses: Poses) -> float:
    """Return the largest angle from a direction during the edit, minus the edit's radius [degrees]."""
    inside = (poses.time_s >= edit.start_s) & (poses.time_s <= edit.end_s)
    if not inside.any():
        inside[np.abs(poses.time_s - edit.start_s).argmin()] = True
    name, own = _of(edit)
    now = rotate(poses.rotations_wxyz[inside, poses.joint_names.index(name)], np.tile(own, (inside.sum(), 1)))
    wanted = _unit(np.array(edit.direction))
    away = np.degrees(np.arccos(np.clip(now @ wanted, -1.0, 1.0)))
    return float(np.maximum(away - edit.radius_deg, 0.0).max())


def _of(edit: DirectionEdit) -> tuple[str, Array]:
    """The output joint of a direction, and the direction in that joint's axes."""
    if edit.of == "head":
        return "Head", HEAD_FORWARD
    return ("LeftHand" if edit.of == "left_palm" else "RightHand"), PALM_OUT


def _turn_to(edit: DirectionEdit, poses: Poses, steps: Array, local: Array) -> None:
    """Turn head or palm to a direction, in place."""
    told = share(edit, poses.time_s)
    rows = np.flatnonzero(told)
    if not len(rows):
        return
    positions, world = world_poses(poses.parents, steps[rows], local[rows])
    name, own = _of(edit)
    joint = poses.joint_names.index(name)
    parent = int(poses.parents[joint])
    wanted = np.tile(_unit(np.array(edit.direction)), (len(rows), 1))
    if edit.of == "head":
        now = rotate(world[:, joint], np.tile(own, (len(rows), 1)))
        turn = _scaled(_swing(now, wanted, edit.radius_deg, MOST_HEAD_DEG), told[rows])
        _turn_world(poses, local, world, rows, ((parent, _scaled(turn, NECK_SHARE)), (joint, turn)))
        return
    axis = _unit(positions[:, joint] - positions[:, parent])
    now = rotate(world[:, joint], np.tile(own, (len(rows), 1)))
    twist = _scaled(_twist(now, wanted, axis, edit.radius_deg), told[rows])
    now = Rotation.from_rotvec(twist).apply(now)
    swing = _scaled(_swing(now, wanted, edit.radius_deg, MOST_WRIST_DEG), told[rows])
    both = (Rotation.from_rotvec(swing) * Rotation.from_rotvec(twist)).as_rotvec()
    _turn_world(poses, local, world, rows, ((parent, _scaled(twist, FOREARM_SHARE)), (joint, both)))


def _turn_world(
    poses: Poses, local: Array, world: Array, rows: NDArray[np.int64], turns: Sequence[tuple[int, Array]]
) -> None:
    """Turn joints, parents first, by rotation vectors in the stage's axes, shape (row_count, 3)."""
    turned = dict[int, Array]()
    for joint, turn in turns:
        quaternion = Rotation.from_rotvec(turn).as_quat(scalar_first=True)
        turned[joint] = multiply(quaternion, world[:, joint])
        parent = int(poses.parents[joint])
        local[rows, joint] = multiply(inverse(turned.get(parent, world[:, parent])), turned[joint])


def _swing(now: Array, wanted: Array, radius_deg: float, most_deg: float) -> Array:
    """Rotation vectors of the shortest turns into a radius about a direction, clipped, shape (count, 3)."""
    axis = np.cross(now, wanted)
    sine = np.linalg.norm(axis, axis=1)
    angle = np.arctan2(sine, np.einsum("ta,ta->t", now, wanted))
    turn = np.clip(angle - np.radians(radius_deg), 0.0, np.radians(most_deg))
    return axis / np.maximum(sine, 1e-9)[:, None] * turn[:, None]


def _twist(now: Array, wanted: Array, axis: Array, radius_deg: float) -> Array:
    """The same for turns about given axes only, to the nearest direction that they allow."""
    flat_now, flat_wanted = (one - np.einsum("ta,ta->t", one, axis)[:, None] * axis for one in (now, wanted))
    sine = np.einsum("ta,ta->t", np.cross(flat_now, flat_wanted), axis)
    angle = np.arctan2(sine, np.einsum("ta,ta->t", flat_now, flat_wanted))
    size = np.clip(np.abs(angle) - np.radians(radius_deg), 0.0, np.radians(MOST_TWIST_DEG))
    return axis * np.multiply(np.sign(angle), size).reshape(-1, 1)


def _scaled(turns: Array, by: Array | float) -> Array:
    return turns * (by[:, None] if isinstance(by, np.ndarray) else by)


def _unit(vectors: Array) -> Array:
    return vectors / np.maximum(np.linalg.norm(vectors, axis=-1, keepdims=True), 1e-9)
