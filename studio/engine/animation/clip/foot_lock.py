"""Foot lock: standing ankles and toes are held at one place, by turning legs and feet.

Stances are found as in finishing (`finish.contacts`). The correction is blended in before a stance and out after it,
so that no foot jumps.
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
from studio.engine.whole_take.finish.contacts import find_contacts

EASE_S = 0.15
ROLLING_M = 0.05
"""A stance that moves by more than this is held along its own smoothed path instead of at one place."""

_JOINTS = ("LeftFoot", "LeftToeBase", "RightFoot", "RightToeBase")
_LEGS = ("LeftUpLeg", "LeftLeg", "RightUpLeg", "RightLeg")


def foot_locked(poses: Poses) -> Poses:
    """Return the poses with standing feet held still.

    Args:
        poses: on a uniform grid, with the legs of the output skeleton.

    Raises:
        SettingsError: the skeleton has no legs.
    """
    index = {name: joint for joint, name in enumerate(poses.joint_names)}
    lacking = [name for name in (*_JOINTS, *_LEGS) if name not in index]
    if lacking:
        raise SettingsError(
            "export.foot_lock_lacks",
            "foot-lock: the skeleton lacks {names}; leave the option out",
            names=[*lacking],
        )
    if poses.frame_count < 3:
        return poses
    feet = poses.positions_m[:, [index[name] for name in _JOINTS]]
    dt = 1.0 / poses.frames_per_second
    contacts = find_contacts(feet, [(0, poses.frame_count)], dt, _rest_heights_m(poses, index))
    ease = max(1, round(EASE_S / dt))
    positions, rotations = poses.positions_m.copy(), poses.rotations_wxyz.copy()
    for side, (ankle, toe) in (("Left", (0, 1)), ("Right", (2, 3))):
        holds, moves = [], []
        for column in (ankle, toe):
            standing = contacts.hold[:, column] > 0.0
            move = _places(feet[:, column], contacts.place_m[:, column], standing) - feet[:, column]
            holds.append(eased(standing.astype(float)[:, None], standing, ease)[:, 0])
            moves.append(eased(move, standing, ease))
        shift = holds[0][:, None] * moves[0] + (1.0 - holds[0])[:, None] * moves[1]
        _move_leg(poses, index, side, shift, moves[1], positions, rotations)
    return replace(poses, positions_m=positions, rotations_wxyz=rotations)


def _rest_heights_m(poses: Poses, index: dict[str, int]) -> Array:
    """Return the heights of `_JOINTS` over the floor in the T-pose with the soles on the floor."""
    offsets, _ = local_keys(poses.parents, poses.positions_m[:1], poses.rotations_wxyz[:1])
    offsets[0, 0] = 0.0
    unturned = np.tile([1.0, 0.0, 0.0, 0.0], (1, len(poses.parents), 1))
    heights = world_poses(poses.parents, offsets, unturned)[0][0, :, 2]
    return heights[[index[name] for name in _JOINTS]] + rest_lift_m(heights, poses.root_height_m)


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
    """Begin and end of each run of true flags."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], flags, [False]])))
    return [(int(a), int(b)) for a, b in zip(edges[::2], edges[1::2], strict=True)]


def _move_leg(
    poses: Poses,
    index: dict[str, int],
    side: str,
    shift: Array,
    toe_shift: Array,
    positions: Array,
    rotations: Array,
) -> None:
    """Move a leg's ankle by `shift` and its toe to `toe_shift` from its present place, in place."""
    hip, knee, ankle, toe = (index[side + name] for name in ("UpLeg", "Leg", "Foot", "ToeBase"))
    at = {joint: poses.positions_m[:, joint] for joint in (hip, knee, ankle, toe)}
    turn = {j: Rotation.from_quat(rotations[:, j], scalar_first=True) for j in (hip, knee, ankle, toe)}
    bends = turn[knee].apply([1.0, 0.0, 0.0])  # a knee bends about the axis to the left
    thigh, shin = reach(at[hip], at[knee], at[ankle], at[ankle] + shift, bends)
    positions[:, knee] = at[hip] + thigh.apply(at[knee] - at[hip])
    positions[:, ankle] = positions[:, knee] + shin.apply(at[ankle] - at[knee])
    sole = at[toe] - at[ankle]
    foot = between(sole, at[toe] + toe_shift - positions[:, ankle])
    weight = np.linalg.norm(toe_shift - shift, axis=1) > 1e-9
    foot = Rotation.from_rotvec(foot.as_rotvec() * weight[:, None])
    positions[:, toe] = positions[:, ankle] + foot.apply(sole)
    for joint, by in ((hip, thigh), (knee, shin), (ankle, foot)):
        rotations[:, joint] = (by * turn[joint]).as_quat(scalar_first=True)
