"""Foot lock: standing ankles and toes are held at one place, by turning legs and feet.

Stances are found as in finishing (`finish.contact.contacts`). The correction is blended in before a stance and out
after it, so that no foot jumps.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from studio.engine.animation.clip.kinematics import Array, local_keys, world_poses
from studio.engine.animation.clip.leg_ik import between, reach
from studio.engine.base.errors import SettingsError
from studio.engine.model.poses import Poses
from studio.engine.model.soles import rest_lift_m
from studio.engine.whole_take.finish.contact.contacts import Contacts, find_contacts

EASE_S = 0.15
ROLLING_M = 0.05
"""A stance that moves by more than this is held along its own smoothed path instead of at one place."""

FEET = ("LeftFoot", "LeftToeBase", "RightFoot", "RightToeBase")
"""Joints that stand, in the order of the columns of `Contacts`."""

LEGS = ("LeftUpLeg", "LeftLeg", "RightUpLeg", "RightLeg", *FEET)


def foot_locked(poses: Poses) -> Poses:
    """Return the poses with standing feet held still.

    Args:
        poses: on a uniform grid, with the legs of the output skeleton.

    Raises:
        SettingsError: the skeleton has no legs.
    """
    lacking = [name for name in LEGS if name not in poses.joint_names]
    if lacking:
        raise SettingsError(
            "export.foot_lock_lacks",
            "foot-lock: the skeleton lacks {names}; leave the option out",
            names=[*lacking],
        )
    if poses.frame_count < 3:
        return poses
    feet, contacts = feet_of(poses), stances_of(poses)
    ease = max(1, round(EASE_S * poses.frames_per_second))
    moved = np.zeros_like(feet)
    for ankle, toe in ((0, 1), (2, 3)):
        holds, moves = [], []
        for column in (ankle, toe):
            standing = contacts.hold[:, column] > 0.0
            move = _places(feet[:, column], contacts.place_m[:, column], standing) - feet[:, column]
            holds.append(eased(standing.astype(float)[:, None], standing, ease)[:, 0])
            moves.append(eased(move, standing, ease))
        moved[:, ankle] = holds[0][:, None] * moves[0] + (1.0 - holds[0])[:, None] * moves[1]
        moved[:, toe] = moves[1]
    return with_feet_moved(poses, moved)


def feet_of(poses: Poses) -> Array:
    """Return the places of `FEET` [m], shape (frame_count, 4, 3)."""
    return poses.positions_m[:, [poses.joint_names.index(name) for name in FEET]]


def stances_of(poses: Poses) -> Contacts:
    """Return the stances of the feet of poses on a uniform grid, with the legs of the output skeleton."""
    pieces, dt = [(0, poses.frame_count)], 1.0 / poses.frames_per_second
    return find_contacts(feet_of(poses), pieces, dt, _rest_heights_m(poses))


def with_feet_moved(poses: Poses, moved: Array, *, soft: bool = True) -> Poses:
    """Return the poses with the legs turned so that `FEET` move [m], shape (frame_count, 4, 3), as far as legs reach.

    `soft`: as in `leg_ik.reach`.
    """
    positions, rotations = poses.positions_m.copy(), poses.rotations_wxyz.copy()
    for side, column in (("Left", 0), ("Right", 2)):
        _move_leg(poses, side, moved[:, column], moved[:, column + 1], positions, rotations, soft=soft)
    return replace(poses, positions_m=positions, rotations_wxyz=rotations)


def _rest_heights_m(poses: Poses) -> Array:
    """Return the heights of `FEET` over the floor in the T-pose with the soles on the floor."""
    offsets, _ = local_keys(poses.parents, poses.positions_m[:1], poses.rotations_wxyz[:1])
    offsets[0, 0] = 0.0
    unturned = np.tile([1.0, 0.0, 0.0, 0.0], (1, len(poses.parents), 1))
    heights = world_poses(poses.parents, offsets, unturned)[0][0, :, 2]
    return heights[[poses.joint_names.index(name) for name in FEET]] + rest_lift_m(
        heights, poses.root_height_m
    )


def _places(path: Array, slow: Array, standing: NDArray[np.bool_]) -> Array:
    """Return the place of a joint, frame by frame: one place per stance; its own path where it does not stand."""
    out = path.copy()
    for begin, end in runs_of(standing):
        place = np.median(path[begin:end], axis=0)
        rolls = np.linalg.norm(path[begin:end] - place, axis=1).max() > ROLLING_M
        out[begin:end] = slow[begin:end] if rolls else place
    return out


def eased(values: Array, standing: NDArray[np.bool_], ease: int) -> Array:
    """Return values, shape (F, n), that are constant in stances, fade outside them, and blend from one into the
    next."""
    out = np.zeros_like(values)
    runs = runs_of(standing)
    for begin, end in runs:
        out[begin:end] = values[begin:end]
    for k, (begin, end) in enumerate(runs):
        before = runs[k - 1][1] if k else -1
        if k == 0 or begin - before >= 2 * ease:
            _fade(out, values[begin], range(begin - 1, max(begin - ease, -1), -1), begin, ease)
        else:  # blend from one stance into the next
            t = (np.arange(before, begin) - before + 1.0) / (begin - before + 1.0)
            share = (t * t * (3 - 2 * t))[:, None]
            out[before:begin] = (1 - share) * values[before - 1] + share * values[begin]
        after = runs[k + 1][0] if k + 1 < len(runs) else None
        if after is None or after - end >= 2 * ease:
            _fade(out, values[end - 1], range(end, min(end + ease - 1, len(out))), end - 1, ease)
    return out


def _fade(out: Array, value: Array, frames: range, edge: int, ease: int) -> None:
    for frame in frames:
        t = 1.0 - abs(frame - edge) / ease
        out[frame] = t * t * (3 - 2 * t) * value


def runs_of(flags: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """Start and end of each run of true flags."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], flags, [False]])))
    return [(int(a), int(b)) for a, b in zip(edges[::2], edges[1::2], strict=True)]


def _move_leg(
    poses: Poses,
    side: str,
    shift: Array,
    toe_shift: Array,
    positions: Array,
    rotations: Array,
    *,
    soft: bool,
) -> None:
    """Move a leg's ankle by `shift` and its toe to `toe_shift` from its present place, in place."""
    hip, knee, ankle, toe = (
        poses.joint_names.index(side + name) for name in ("UpLeg", "Leg", "Foot", "ToeBase")
    )
    at = {joint: poses.positions_m[:, joint] for joint in (hip, knee, ankle, toe)}
    turn = {j: Rotation.from_quat(rotations[:, j], scalar_first=True) for j in (hip, knee, ankle, toe)}
    bends = turn[knee].apply([1.0, 0.0, 0.0])  # a knee bends about the axis to the left
    thigh, shin = reach(at[hip], at[knee], at[ankle], at[ankle] + shift, bends, soft=soft)
    positions[:, knee] = at[hip] + thigh.apply(at[knee] - at[hip])
    positions[:, ankle] = positions[:, knee] + shin.apply(at[ankle] - at[knee])
    sole = at[toe] - at[ankle]
    foot = between(sole, at[toe] + toe_shift - positions[:, ankle])
    weight = np.linalg.norm(toe_shift - shift, axis=1) > 1e-9
    foot = Rotation.from_rotvec(foot.as_rotvec() * weight[:, None])
    positions[:, toe] = positions[:, ankle] + foot.apply(sole)
    for joint, by in ((hip, thigh), (knee, shin), (ankle, foot)):
        rotations[:, joint] = (by * turn[joint]).as_quat(scalar_first=True)
