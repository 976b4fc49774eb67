"""Rotation of each bone from a rig's rest pose, a T-pose or an A-pose, to the T-pose of the motion."""

import numpy as np
from numpy.typing import NDArray

from studio.engine.animation.read.imported import facing_turn
from studio.engine.animation.retarget.mapping import Mapping
from studio.engine.base.errors import FormatError
from studio.engine.base.geometry import rotation_between
from studio.engine.model.joints import FINGERS

Array = NDArray[np.float64]

_FILE_STAGE = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])

_BONES = {
    f"{side}{role}": f"{side}{child}"
    for side in ("Left", "Right")
    for role, child in (
        ("Arm", "ForeArm"), ("ForeArm", "Hand"), ("Hand", "HandMiddle1"), ("UpLeg", "Leg"), ("Leg", "Foot"),
        *((f"Hand{finger}{k}", f"Hand{finger}{k + 1}") for finger in FINGERS if finger != "Thumb" for k in (1, 2)),
    )
}  # fmt: skip
"""Role -> the role at the end of its bone, for bones that are turned to the motion's T-pose. A thumb keeps
its rest pose, which differs more between rigs than thumbs do.
"""

_KEEPS_LIMB = ("Hand", "ToeBase")


def t_pose_turns(mapping: Mapping, source: dict[str, Array]) -> Array:
    """Return each bone's rotation from the rig's rest pose to the motion's T-pose, world, shape (J, 3, 3).

    The body is turned to face +z. Arms, hands, fingers and legs get the directions of the motion. Feet get its
    heading and keep their slope, so that a sole that is flat at rest is flat in the T-pose. Other bones with a role
    keep their rest pose, and a bone without one follows its parent.

    Args:
        mapping: of the rig.
        source: rest position of each role of the motion, y up, facing +z, shape (3,).

    Raises:
        FormatError: the rest pose does not stand, or its left and right are inconsistent.
    """
    rig, joints = mapping.rig, mapping.joints
    facing, moved = _facing(mapping), _at_or_below(mapping)
    out = np.empty((len(mapping.roles), 3, 3))
    for joint, (role, parent) in enumerate(zip(mapping.roles, rig.parents.tolist(), strict=True)):
        above = facing if parent < 0 or parent not in moved else out[parent]
        out[joint] = above
        if not role:
            continue
        if not any(part in role for part in _KEEPS_LIMB):
            out[joint] = facing if role not in _BONES else above
        child = _BONES.get(role)
        if child in joints and role in source and child in source:
            bone = above @ (rig.positions_m[joints[child]] - rig.positions_m[joint])
            out[joint] = rotation_between(bone, source[child] - source[role]) @ above
        elif role.endswith("Foot"):
            out[joint] = _heading(mapping, role, facing, source)
    return out


def _at_or_below(mapping: Mapping) -> set[int]:
    """Indices of the hips and all bones below them."""
    hips = mapping.joints["Hips"]
    return {joint for joint in range(len(mapping.roles)) if mapping.rig.below(joint, hips)}


def _facing(mapping: Mapping) -> Array:
    """Return the turn about the vertical after which the rig faces +z, shape (3, 3)."""
    at = {role: mapping.rig.positions_m[joint] for role, joint in mapping.joints.items()}
    hips, feet = (at["LeftUpLeg"] + at["RightUpLeg"]) / 2, (at["LeftFoot"] + at["RightFoot"]) / 2
    leg = np.linalg.norm(at["LeftUpLeg"] - at["LeftLeg"]) + np.linalg.norm(at["LeftLeg"] - at["LeftFoot"])
    what = mapping.rig.path
    if hips[1] - feet[1] < 0.5 * leg:
        raise FormatError(
            "rig.not_upright",
            "{path}: the rest pose does not stand upright along y; export it in its T-pose, y up",
            path=what,
        )
    stage = mapping.rig.positions_m @ _FILE_STAGE
    facing = _FILE_STAGE @ facing_turn(mapping.joints, stage) @ _FILE_STAGE.T
    for pair in ("UpLeg", "Arm"):
        if {f"Left{pair}", f"Right{pair}"} <= at.keys():
            lateral = facing @ (at[f"Left{pair}"] - at[f"Right{pair}"])
            if lateral[0] <= 0:
                raise FormatError(
                    "rig.sides_exchanged",
                    "{path}: left and right of {names} are the other way round than elsewhere; correct "
                    "the mapping",
                    path=what,
                    names=pair,
                )
    if {"LeftToeBase", "RightToeBase"} <= at.keys():
        ahead = facing @ (at["LeftToeBase"] - at["LeftFoot"] + at["RightToeBase"] - at["RightFoot"])
        if ahead[2] < -0.5 * np.linalg.norm(ahead):
            raise FormatError(
                "rig.feet_backwards",
                "{path}: the feet point backwards: left and right are exchanged; correct the mapping",
                path=what,
            )
    return facing


def _heading(mapping: Mapping, role: str, facing: Array, source: dict[str, Array]) -> Array:
    """Return the rotation of a foot to the motion's heading; its sole keeps its slope."""
    toe = f"{role.removesuffix('Foot')}ToeBase"
    joints, at = mapping.joints, mapping.rig.positions_m
    if toe not in joints or toe not in source:
        return facing
    flat = np.array([1.0, 0.0, 1.0])
    bone = flat * (facing @ (at[joints[toe]] - at[joints[role]]))
    return rotation_between(bone, flat * (source[toe] - source[role])) @ facing
