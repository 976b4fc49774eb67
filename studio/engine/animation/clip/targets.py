"""Skeletons of other programs: the same motion on bones of other names, number and axes.

One HumanIK joint carries each bone of a target rigidly, so every joint that the two skeletons share is at
exactly the same place in every frame.

Names: Mixamo's auto-rigger; VRM 1.0 humanoid bones (which are Unity's, except for the thumbs). Unreal's are in
`unreal`.
"""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from studio.engine.animation.clip.root_motion import with_root_motion
from studio.engine.animation.clip.skeleton import OFFSET_TOLERANCE_M, LocalMotion, end_sites
from studio.engine.animation.clip.unreal import UNREAL_BONES, Bone, unreal_axes
from studio.engine.base.errors import SettingsError
from studio.engine.base.geometry import quaternions
from studio.engine.base.quaternions import IDENTITY, Array, continuous_signs, inverse, multiply, rotate

_VRM_BODY = {"Hips": "hips", "Spine": "spine", "Spine1": "chest", "Spine2": "upperChest", "Neck": "neck",
             "Head": "head"}  # fmt: skip
_VRM_SIDE = {"Shoulder": "Shoulder", "Arm": "UpperArm", "ForeArm": "LowerArm", "Hand": "Hand",
             "UpLeg": "UpperLeg", "Leg": "LowerLeg", "Foot": "Foot", "ToeBase": "Toes"}  # fmt: skip
_VRM_SEGMENTS = ("Proximal", "Intermediate", "Distal")
_VRM_THUMB = ("Metacarpal", "Proximal", "Distal")

_ROOT_NAMES = {"humanik": "Reference", "mixamo": "mixamorig:Root", "vrm": "Root", "unreal": "root"}


def on_target(motion: LocalMotion, target: str, root_motion: str) -> LocalMotion:
    """Return the motion on the skeleton of a target, with its path on the chosen carrier.

    Args:
        motion: with HumanIK names and identity axes, hips first (`local_motion`).
        target: one of `TARGETS`; root_motion: one of `ROOT_MOTIONS`.

    Raises:
        SettingsError: the motion's skeleton lacks the hips, or a joint of one of the target's bones.
    """
    if motion.roles[0] != "Hips":
        what = "root-motion" if target == "humanik" else "target"
        value = root_motion if target == "humanik" else target
        if target == "humanik" and root_motion == "hips":
            return motion
        raise SettingsError(
            "export.no_hips",
            "{option}={value}: the skeleton has no hips at its root but {root!r}; leave the "
            "option out, or solve the take with the studio's skeleton",
            option=what,
            value=value,
            root=motion.roles[0],
        )
    needs_root = target == "unreal" or root_motion == "root"
    motion = with_root_motion(motion, root_motion, _ROOT_NAMES[target] if needs_root else None)
    if target == "mixamo":
        return _renamed(_with_ends(motion), lambda role: f"mixamorig:{role}")
    if target == "vrm":
        return _renamed(motion, _vrm_name)
    return _on_bones(motion, UNREAL_BONES) if target == "unreal" else motion


def _renamed(motion: LocalMotion, name_of: Callable[[str], str]) -> LocalMotion:
    pairs = zip(motion.roles, motion.joint_names, strict=True)
    return replace(motion, joint_names=tuple(name_of(role) if role else name for role, name in pairs))


def _vrm_name(role: str) -> str:
    if role in _VRM_BODY:
        return _VRM_BODY[role]
    side = "left" if role.startswith("Left") else "right"
    part = role.removeprefix("Left").removeprefix("Right")
    if part in _VRM_SIDE:
        return side + _VRM_SIDE[part]
    finger, segment = part.removeprefix("Hand")[:-1], int(part[-1]) - 1
    if finger == "Thumb":
        return f"{side}Thumb{_VRM_THUMB[segment]}"
    return f"{side}{'Little' if finger == 'Pinky' else finger}{_VRM_SEGMENTS[segment]}"


def _with_ends(motion: LocalMotion) -> LocalMotion:
    """Return the motion with end bones of head, toes and fingers, as in Mixamo's skeleton."""
    ends = end_sites(motion)
    names = {"Head": "HeadTop_End", "LeftToeBase": "LeftToe_End", "RightToeBase": "RightToe_End"}
    added = {joint: names.get(motion.roles[joint], f"{motion.roles[joint][:-1]}4") for joint in ends}
    order: list[tuple[int, bool]] = []  # (joint, whether it is the end of that joint)
    for joint in range(len(motion.parents)):
        order += [(joint, False), (joint, True)] if joint in ends else [(joint, False)]
    place = {joint: i for i, (joint, end) in enumerate(order) if not end}
    still = np.tile(IDENTITY, (motion.frame_count, 1))
    parents = [
        place[j] if end else (place[int(motion.parents[j])] if motion.parents[j] >= 0 else -1)
        for j, end in order
    ]
    return replace(
        motion,
        joint_names=tuple(f"mixamorig:{added[j]}" if end else motion.joint_names[j] for j, end in order),
        roles=tuple("" if end else motion.roles[j] for j, end in order),
        parents=np.array(parents),
        offsets_m=np.array([ends[j] if end else motion.offsets_m[j] for j, end in order]),
        rest_rotations_wxyz=np.tile(IDENTITY, (len(order), 1)),
        positions_m={place[j]: keys for j, keys in motion.positions_m.items()},
        rotations_wxyz=np.stack([still if end else motion.rotations_wxyz[:, j] for j, end in order], axis=1),
    )


def _on_bones(motion: LocalMotion, bones: tuple[Bone, ...]) -> LocalMotion:
    """Return the motion on bones with their own names, places and axes."""
    sources = {role: joint for joint, role in enumerate(motion.roles)}
    lacking = sorted({bone.source for bone in bones} - set(sources))
    if lacking:
        raise SettingsError(
            "export.unreal_lacks",
            "target=unreal: the skeleton lacks {names}; choose another target",
            names=[*lacking],
        )
    index = {bone.name: i for i, bone in enumerate(bones)}
    rest_at = motion.rest_positions_m
    rest = np.array([_rest_place(bone, rest_at, sources) for bone in bones])
    axes = quaternions(np.array([unreal_axes(bone, rest_at, sources) for bone in bones]))
    parents = np.array([index[bone.parent] if bone.parent else -1 for bone in bones])
    offsets, positions = rest.copy(), {}
    rotations = np.empty((motion.frame_count, len(bones), 4))
    for i, bone in enumerate(bones):
        above, source = int(parents[i]), sources[bone.source]
        carrier = -1 if above < 0 else sources[bones[above].source]
        to_axes = IDENTITY if above < 0 else inverse(axes[above])
        arm = np.zeros(3) if above < 0 else rest[above] - rest_at[carrier]
        if above >= 0:
            offsets[i] = rotate(to_axes, rest[i] - rest[above])
        places, turns = _relative(motion, carrier, source)
        keys = rotate(to_axes, places + rotate(turns, rest[i] - rest_at[source]) - arm)
        if np.linalg.norm(keys - offsets[i], axis=1).max() > OFFSET_TOLERANCE_M:
            positions[i] = np.broadcast_to(keys, (motion.frame_count, 3))
        rotations[:, i] = multiply(multiply(to_axes, turns), axes[i])
    return replace(
        motion,
        joint_names=tuple(bone.name for bone in bones),
        roles=tuple(bone.role for bone in bones),
        parents=parents,
        offsets_m=offsets,
        rest_rotations_wxyz=axes,
        positions_m=positions,
        rotations_wxyz=continuous_signs(rotations),
    )


def _rest_place(bone: Bone, rest_at: Array, sources: dict[str, int]) -> Array:
    start = rest_at[sources[bone.source]]
    return start if bone.towards is None else start + bone.share * (rest_at[sources[bone.towards]] - start)


def _relative(motion: LocalMotion, above: int, joint: int) -> tuple[Array, Array]:
    """Return a joint's positions and rotations in the axes of another (-1: the file's), shapes (F, 3), (F, 4).

    A static joint has one frame for all.
    """
    chain, up = [], joint
    while up >= 0 and up != above:
        chain.append(up)
        up = int(motion.parents[up])
    if up != above:  # not an ancestor of the joint: go through the file's axes
        (place, turn), (other_place, other_turn) = _relative(motion, -1, joint), _relative(motion, -1, above)
        back = inverse(other_turn)
        return rotate(back, place - other_place), multiply(back, turn)
    places, turns = np.zeros((1, 3)), IDENTITY[None]
    for link in reversed(chain):
        keys = motion.positions_m.get(link, motion.offsets_m[link][None])
        places = places + rotate(turns, keys)
        turns = multiply(turns, motion.rotations_wxyz[:, link])
    return places, turns
