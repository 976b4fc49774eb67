"""From a file's skeleton to the canonical joints, by joint names (`model.roles`)."""

import numpy as np
from numpy.typing import NDArray

from studio.engine.animation.motion.motion import END, CanonicalMotion, Motion
from studio.engine.animation.motion.proportions import t_pose_offsets
from studio.engine.base.errors import FormatError
from studio.engine.base.geometry import unit
from studio.engine.model.joints import CANONICAL, INDEX, OUTPUT_OF_CANONICAL
from studio.engine.model.roles import roles_of

_BY_PLACE = ("spine", "chest", "neck")  # recognised by their place in the tree
_OPTIONAL = ("hand", "toe")  # replaced by the end of the limb if missing


def _ancestors(parents: NDArray[np.int64], joint: int) -> list[int]:
    """The joint and its ancestors, root last."""
    chain = [joint]
    while parents[chain[-1]] >= 0:
        chain.append(int(parents[chain[-1]]))
    return chain


def canonical_joints(motion: Motion) -> dict[str, int]:
    """Return the index of the file's joint for each canonical joint.

    `chest` is where the arms branch off, `spine` the joint nearest to halfway from the hips to it. A missing hand or
    toe is the end of its limb, with the index of the End Site.

    Raises:
        FormatError: the skeleton lacks its hips, a limb or the head; the message names it and the joints.
    """
    roles = roles_of(motion.joint_names, motion.parents.tolist())
    by_role = {role: joint for joint, role in enumerate(roles) if role}
    found = {name: by_role.get(OUTPUT_OF_CANONICAL[name]) for name in CANONICAL if name not in _BY_PLACE}
    for side in ("left", "right"):
        if found[f"{side}_hand"] is None:
            found[f"{side}_hand"] = by_role.get(f"{side.capitalize()}HandIndex1")
        for end, parent in (("hand", "wrist"), ("toe", "ankle")):
            if found[f"{side}_{end}"] is None:
                found[f"{side}_{end}"] = _end_of(motion, found[f"{side}_{parent}"])
    missing = [
        name for name, index in found.items() if index is None and name.split("_")[-1] not in _OPTIONAL
    ]
    if missing:
        names = ", ".join(name for name in motion.joint_names if END not in name)[:400]
        raise FormatError(
            "skeleton.joints_missing",
            "the skeleton has no joint for {names} under any known name (HumanIK, Mixamo, "
            "Unreal, VRM, CMU, Kinect, Xsens, Rokoko...); it has {others}; rename its joints",
            names=[*missing],
            others=names,
        )
    joints = {name: index for name, index in found.items() if index is not None}
    right = _ancestors(motion.parents, joints["right_shoulder"])
    chest = next(
        (i for i in _ancestors(motion.parents, joints["left_shoulder"]) if i in right), joints["hips"]
    )
    joints["chest"] = chest
    joints["spine"] = _spine(motion, joints["hips"], chest)
    joints["neck"] = by_role.get("Neck", int(motion.parents[joints["head"]]))
    return joints


def _end_of(motion: Motion, joint: int | None) -> int | None:
    """The joint's End Site, or its only child."""
    if joint is None:
        return None
    children = [i for i, parent in enumerate(motion.parents) if parent == joint]
    ends = [i for i in children if END in motion.joint_names[i]]
    return next(iter(ends or children), None)


def _spine(motion: Motion, hips: int, chest: int) -> int:
    """The joint nearest to halfway between hips and chest; the chest where there is none between them."""
    chain = list(reversed(_ancestors(motion.parents, chest)))
    between = chain[chain.index(hips) + 1 : -1] if hips in chain else chain[:-1]
    low, high = motion.rest_m[hips], motion.rest_m[chest]
    between = [joint for joint in between if np.linalg.norm(motion.rest_m[joint] - low) > 1e-4]
    return min(
        between, key=lambda j: float(np.linalg.norm(motion.rest_m[j] - (low + high) / 2)), default=chest
    )


def to_canonical(motion: Motion) -> CanonicalMotion:
    """Return a file's motion in canonical joints, at its place on the stage; the hands stay open.

    A missing hand without an End Site lies 8 cm beyond the wrist, a toe 15 cm before the ankle.

    Raises:
        FormatError: the skeleton lacks its hips, a limb or the head, or is not upright with y up.
    """
    joints = canonical_joints(motion)
    positions = _pick(motion.positions_m, motion.rotations, joints)
    rest_rotations = np.broadcast_to(np.eye(3), (1, len(motion.joint_names), 3, 3))
    rest = _pick(motion.rest_m[None], rest_rotations, joints)[0]
    if not _is_upright(rest):
        rest = positions[0]
    if not _is_upright(rest):
        raise FormatError(
            "skeleton.not_upright",
            "neither the file's rest pose nor its first frame stands upright with y up; export "
            "it with y up, from a T-pose",
        )
    return CanonicalMotion(
        frame_s=motion.frame_s,
        positions_m=positions,
        offsets_m=t_pose_offsets(rest),
        hands_open=np.ones((motion.frame_count, 2)),
    )


def _pick(
    positions: NDArray[np.float64], rotations: NDArray[np.float64], joints: dict[str, int]
) -> NDArray[np.float64]:
    out = np.empty((len(positions), len(CANONICAL), 3))
    for name, index in joints.items():
        out[:, INDEX[name]] = positions[:, index]
    for side in ("left", "right"):
        hand, wrist, elbow = (INDEX[f"{side}_{joint}"] for joint in ("hand", "wrist", "elbow"))
        if f"{side}_hand" not in joints:
            out[:, hand] = out[:, wrist] + 0.08 * unit(out[:, wrist] - out[:, elbow])
        if f"{side}_toe" not in joints:
            ankle = joints[f"{side}_ankle"]
            out[:, INDEX[f"{side}_toe"]] = positions[:, ankle] + rotations[:, ankle] @ np.array(
                [0, -0.15, -0.06]
            )
    return out


def _is_upright(pose: NDArray[np.float64]) -> bool:
    up = pose[INDEX["head"]] - (pose[INDEX["left_ankle"]] + pose[INDEX["right_ankle"]]) / 2
    length = float(np.linalg.norm(up))
    return length > 0 and up[2] > 0.8 * length
