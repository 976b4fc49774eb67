"""Poses of a foreign animation: HumanIK names where a joint's role is known, joints at their places.

A joint's rotation is the identity in the T-pose. A file may have another rest pose (an A-pose, legs apart, facing
elsewhere), so each limb's rest direction is first turned to that of the T-pose.
"""

import os
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from studio.engine.animation.motion.motion import END, Motion
from studio.engine.animation.read.files import joints_of_points, read_animation
from studio.engine.animation.read.landmarks import canonical_points
from studio.engine.animation.read.points import NamedPoints
from studio.engine.base.errors import FormatError
from studio.engine.base.geometry import quaternions, rotation_between
from studio.engine.calibration.cameras.merge import Walk
from studio.engine.calibration.performer.proportions import measure
from studio.engine.model.human.skeleton import Skeleton, forward_positions
from studio.engine.model.joints import (
    OUTPUT_JOINTS,
    OUTPUT_OF_CANONICAL_INDEX,
    OUTPUT_PARENTS,
)
from studio.engine.model.poses import Poses
from studio.engine.model.roles import roles_of

Array = NDArray[np.float64]


def imported_poses(
    path: str | os.PathLike[str],
    *,
    unit_m: float | None = None,
    progress: Callable[[float], None] = lambda _: None,
) -> tuple[Poses, list[str]]:
    """Return the poses in an animation file, its first frame at time 0, and notes on the choices made.

    Args:
        path: a file that `files.read_animation` reads.
        unit_m: metres per unit of a BVH.
        progress: called with 0..1 while points become poses; the rest takes seconds.

    Raises:
        FormatError, NotAvailableError, SettingsError: as `read_animation`; or a skeleton without hips.
    """
    animation = read_animation(path, unit_m=unit_m)
    if isinstance(animation, NamedPoints):
        poses = poses_of_points(animation, str(path), progress=progress)
        seen = int((poses.confidence > 0).any(axis=0).sum())
        return poses, [f"{len(animation.names)} points, {seen} joints told by them", *animation.notes]
    poses = poses_of_motion(animation, str(path))
    known = sum(name in OUTPUT_JOINTS for name in poses.joint_names)
    return poses, [f"{len(poses.joint_names)} joints, {known} of known role"]


def poses_of_motion(motion: Motion, what: str) -> Poses:
    """Return a skeleton's motion as poses, without the ends of its last bones.

    Raises:
        FormatError: no joint is known as the hips.
    """
    keep = [joint for joint, name in enumerate(motion.joint_names) if not name.endswith(END)]
    place = {joint: k for k, joint in enumerate(keep)}
    parents = np.array([place.get(int(motion.parents[joint]), -1) for joint in keep], dtype=np.int64)
    names = [motion.joint_names[joint] for joint in keep]
    roles = roles_of(names, parents.tolist())
    if "Hips" not in roles:
        raise FormatError(
            "animation.no_hips",
            "{what}: no joint for the hips under any known name; rename its joints",
            what=what,
        )
    turned = to_t_pose(roles, parents, motion.rest_m[keep])
    rotations = motion.rotations[:, keep] @ np.swapaxes(turned, -1, -2)
    frames, joints = rotations.shape[:2]
    return Poses(
        time_s=np.arange(frames) * motion.frame_s,
        joint_names=_names(names, roles),
        parents=parents,
        positions_m=np.ascontiguousarray(motion.positions_m[:, keep]),
        rotations_wxyz=quaternions(rotations.reshape(-1, 3, 3)).reshape(frames, joints, 4),
        confidence=np.ones((frames, joints)),
        uncertainty_mm=np.full((frames, joints), np.nan),
    )


def to_t_pose(roles: tuple[str, ...], parents: NDArray[np.int64], rest_m: Array) -> Array:
    """Return each bone's rotation from the rest pose to the T-pose, world axes, shape (joint_count, 3, 3).

    The whole body is turned to face -y. Arms and hands lie along x, legs point straight down, feet ahead.
    A bone within 15 degrees of that stays: such a rest pose is a T-pose. Joints without a role follow their parent.
    """
    index = {role: joint for joint, role in enumerate(roles) if role}
    facing = facing_turn(index, rest_m)
    out = np.empty((len(roles), 3, 3))
    for joint, (role, parent) in enumerate(zip(roles, parents.tolist(), strict=True)):
        above = facing if parent < 0 else out[parent]
        limb = _LIMBS.get(role)
        if limb is None:
            out[joint] = above if not role or parent < 0 or _in_limb(role) else facing
            continue
        child, way = limb
        out[joint] = above
        if child in index:
            bone = above @ (rest_m[index[child]] - rest_m[joint])
            goal = np.array(way) if any(way) else np.array([0.0, -np.hypot(bone[0], bone[1]), bone[2]])
            lengths = np.linalg.norm(bone) * np.linalg.norm(goal)
            if lengths > 1e-12 and bone @ goal < _THERE_COSINE * lengths:
                out[joint] = rotation_between(bone, goal) @ above
    return out


_THERE_COSINE = np.cos(np.radians(15.0))

_LIMBS: dict[str, tuple[str, tuple[float, float, float]]] = {
    f"{side}{role}": (f"{side}{child}", way)
    for side, x in (("Left", 1.0), ("Right", -1.0))
    for role, child, way in (
        ("Arm", "ForeArm", (x, 0.0, 0.0)), ("ForeArm", "Hand", (x, 0.0, 0.0)), ("Hand", "HandMiddle1", (x, 0.0, 0.0)),
        ("UpLeg", "Leg", (0.0, 0.0, -1.0)), ("Leg", "Foot", (0.0, 0.0, -1.0)), ("Foot", "ToeBase", (0.0, 0.0, 0.0)),
    )
}  # fmt: skip
"""Role -> the joint at the end of its bone, and the bone's direction in the T-pose; zeros = ahead, with its own
slope."""


def _in_limb(role: str) -> bool:
    """Whether a role without a bone of its own in `_LIMBS` turns with its parent: fingers and toes."""
    return "Hand" in role or role.endswith("ToeBase")


def facing_turn(index: dict[str, int], rest_m: Array) -> Array:
    """Return the turn about the vertical that brings the body's left to +x, shape (3, 3)."""
    lateral = np.zeros(3)
    for name in ("UpLeg", "Arm"):
        if f"Left{name}" in index and f"Right{name}" in index:
            lateral += rest_m[index[f"Left{name}"]] - rest_m[index[f"Right{name}"]]
    if np.hypot(lateral[0], lateral[1]) < 1e-6:
        return np.eye(3)
    c, s = lateral[:2] / np.hypot(lateral[0], lateral[1])
    return np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])


def _names(names: list[str], roles: tuple[str, ...]) -> tuple[str, ...]:
    """Return roles; a joint without one keeps its name, changed if another joint has that role."""
    taken = set(roles)
    return tuple(
        role or (f"{name}_" if name in taken else name) for name, role in zip(names, roles, strict=True)
    )


def poses_of_points(
    points: NamedPoints, what: str, *, progress: Callable[[float], None] = lambda _: None
) -> Poses:
    """Return points as poses of the output skeleton: measured joints at their points, the others by the skeleton.

    The confidence is 1 where a point gives the joint, and 0 in gaps and for joints without a point.

    Raises:
        FormatError: as `files.joints_of_points`; or the points do not determine proportions or the trunk's pose.
    """
    from studio.engine.solve.ik.swing import swing_rotations  # slow to load: not at the start of the server

    told = np.isfinite(canonical_points(points)).all(axis=2)
    joints = joints_of_points(points, what)
    weights = np.all(np.isfinite(joints), axis=2).astype(np.float64)
    performer = measure(Walk(points.time_s, joints[None], weights[None], joints))
    if performer is None:
        raise FormatError(
            "animation.few_points",
            "{what}: too little of a body is told to know its proportions; name more of its points",
            what=what,
        )
    skeleton = Skeleton.of(performer)
    known = np.isfinite(joints).all(axis=(0, 2))
    frames = len(joints)
    positions, rotations = np.empty((frames, 52, 3)), np.empty((frames, 52, 3, 3))
    last: Array | None = None
    for frame in range(frames):
        turned = swing_rotations(skeleton, joints[frame])
        last = turned if turned is not None and np.isfinite(turned).all() else last
        if last is None:
            raise FormatError(
                "animation.not_standing",
                "{what}: hips, shoulders and neck do not tell how the performer stands in frame {n}",
                what=what,
                n=frame + 1,
            )
        rotations[frame] = last
        positions[frame] = forward_positions(skeleton, joints[frame, 0], last)
        if frame % 256 == 0:
            progress(frame / frames)
    positions[:, OUTPUT_OF_CANONICAL_INDEX[known]] = joints[:, known]
    confidence = np.zeros((frames, len(OUTPUT_JOINTS)))
    confidence[:, OUTPUT_OF_CANONICAL_INDEX] = told
    return Poses(
        time_s=points.time_s,
        joint_names=OUTPUT_JOINTS,
        parents=OUTPUT_PARENTS,
        positions_m=positions,
        rotations_wxyz=quaternions(rotations.reshape(-1, 3, 3)).reshape(frames, -1, 4),
        confidence=confidence,
        uncertainty_mm=np.full(confidence.shape, np.nan),
    )
