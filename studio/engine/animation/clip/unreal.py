"""The skeleton of Unreal Engine 5's mannequin (Manny and Quinn): its 89 bones in their order, and their axes.

Axes in the T-pose, as (x, y); z follows. A bone's x axis lies along the bone: to its child on the trunk, the left
arm and the right leg, away from it on the right arm and the left leg. Elbows, knees and fingers bend about z. Of the
five spine joints, the third is HumanIK's Spine1 and the fifth Spine2. The second and fourth, the second neck
joint, the metacarpals and the twist bones are carried rigidly. `ik_` bones follow feet and hands.

Source: the engine's own skeleton SK_Mannequin in its FBX export (bone names, order, local axes).
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

_LEFT, _UP, _FORWARD = np.eye(3)


@dataclass(frozen=True)
class Bone:
    """A bone of a target: its name, its parent's, the HumanIK joint that carries it ("" = the root bone), its
    `role` ("" = none), and its position: at its source, or a `share` of the way towards
    another joint. `like` names the bone whose axes it has.
    """

    name: str
    parent: str | None
    source: str
    role: str = ""
    towards: str | None = None
    share: float = 0.0
    like: str = ""


def _arm(s: str) -> list[Bone]:
    side = "Left" if s == "l" else "Right"
    arm, fore, hand = f"{side}Arm", f"{side}ForeArm", f"{side}Hand"
    bones = [
        Bone(f"clavicle_{s}", "spine_05", f"{side}Shoulder", f"{side}Shoulder"),
        Bone(f"upperarm_{s}", f"clavicle_{s}", arm, arm),
        Bone(f"lowerarm_{s}", f"upperarm_{s}", fore, fore),
        Bone(f"lowerarm_twist_02_{s}", f"lowerarm_{s}", fore, "", hand, 1 / 3, f"lowerarm_{s}"),
        Bone(f"lowerarm_twist_01_{s}", f"lowerarm_{s}", fore, "", hand, 2 / 3, f"lowerarm_{s}"),
        Bone(f"hand_{s}", f"lowerarm_{s}", hand, hand),
    ]
    for finger in ("Index", "Middle", "Pinky", "Ring"):
        low = finger.lower()
        joints = [f"{hand}{finger}{k}" for k in (1, 2, 3)]
        bones.append(Bone(f"{low}_metacarpal_{s}", f"hand_{s}", hand, "", joints[0], 0.35))
        above = [f"{low}_metacarpal_{s}", f"{low}_01_{s}", f"{low}_02_{s}"]
        bones += [Bone(f"{low}_0{k + 1}_{s}", above[k], joints[k], joints[k]) for k in range(3)]
    above = [f"hand_{s}", f"thumb_01_{s}", f"thumb_02_{s}"]
    joints = [f"{hand}Thumb{k}" for k in (1, 2, 3)]
    bones += [Bone(f"thumb_0{k + 1}_{s}", above[k], joints[k], joints[k]) for k in range(3)]
    bones += [
        Bone(f"upperarm_twist_0{k}_{s}", f"upperarm_{s}", arm, "", fore, k / 3, f"upperarm_{s}")
        for k in (1, 2)
    ]
    return bones


def _leg(s: str) -> list[Bone]:
    side = "Left" if s == "l" else "Right"
    thigh, calf, foot, ball = (f"{side}{part}" for part in ("UpLeg", "Leg", "Foot", "ToeBase"))
    return [
        Bone(f"thigh_{s}", "pelvis", thigh, thigh),
        Bone(f"calf_{s}", f"thigh_{s}", calf, calf),
        Bone(f"calf_twist_02_{s}", f"calf_{s}", calf, "", foot, 1 / 3, f"calf_{s}"),
        Bone(f"calf_twist_01_{s}", f"calf_{s}", calf, "", foot, 2 / 3, f"calf_{s}"),
        Bone(f"foot_{s}", f"calf_{s}", foot, foot),
        Bone(f"ball_{s}", f"foot_{s}", ball, ball),
        *(Bone(f"thigh_twist_0{k}_{s}", f"thigh_{s}", thigh, "", calf, k / 3, f"thigh_{s}") for k in (1, 2)),
    ]


UNREAL_BONES: tuple[Bone, ...] = (
    Bone("root", None, ""),
    Bone("pelvis", "root", "Hips", "Hips"),
    Bone("spine_01", "pelvis", "Spine", "Spine"),
    Bone("spine_02", "spine_01", "Spine", "", "Spine1", 0.5),
    Bone("spine_03", "spine_02", "Spine1", "Spine1"),
    Bone("spine_04", "spine_03", "Spine1", "", "Spine2", 0.5),
    Bone("spine_05", "spine_04", "Spine2", "Spine2"),
    *_arm("l"),
    *_arm("r"),
    Bone("neck_01", "spine_05", "Neck", "Neck"),
    Bone("neck_02", "neck_01", "Neck", "", "Head", 0.5),
    Bone("head", "neck_02", "Head", "Head"),
    *_leg("l"),
    *_leg("r"),
    Bone("ik_foot_root", "root", "", like="root"),
    Bone("ik_foot_l", "ik_foot_root", "LeftFoot", like="foot_l"),
    Bone("ik_foot_r", "ik_foot_root", "RightFoot", like="foot_r"),
    Bone("ik_hand_root", "root", "", like="root"),
    Bone("ik_hand_gun", "ik_hand_root", "RightHand", like="hand_r"),
    Bone("ik_hand_l", "ik_hand_gun", "LeftHand", like="hand_l"),
    Bone("ik_hand_r", "ik_hand_gun", "RightHand", like="hand_r"),
    Bone("interaction", "root", "", like="root"),
    Bone("center_of_mass", "root", "", like="root"),
)
"""The mannequin's bones, parents first."""


def unreal_axes(bone: Bone, rest_at: NDArray[np.float64], sources: dict[str, int]) -> NDArray[np.float64]:
    """Return a bone's axes in the T-pose as columns in file axes, shape (3, 3).

    Args:
        bone: one of `UNREAL_BONES`.
        rest_at: rest positions of the HumanIK joints, shape (joint_count, 3).
        sources: HumanIK name -> index into `rest_at`.
    """
    name = bone.like or bone.name
    if name == "root":
        return np.column_stack([_LEFT, -_FORWARD, _UP])
    part, side = (name[:-2], name[-1]) if name[-2:] in ("_l", "_r") else (name, "")
    mirror = -1.0 if side == "r" else 1.0
    x, y = _aim(part, side, bone, rest_at, sources)
    x, y = mirror * x, mirror * y
    y = y - (y @ x) * x
    y /= np.linalg.norm(y)
    return np.column_stack([x, y, np.cross(x, y)])


def _aim(
    part: str, side: str, bone: Bone, rest_at: NDArray[np.float64], sources: dict[str, int]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return a bone's x axis and approximate y axis on the left side; the right side has both opposite."""
    hand = ("Left" if side == "l" else "Right") + "Hand"
    if part in ("pelvis", "head"):
        return _UP, -_FORWARD
    if part == "foot":
        return _UP, -_FORWARD
    if part == "ball":
        return _FORWARD, _UP
    if part == "hand":
        return _direction(rest_at, sources, hand, f"{hand}Middle1"), -_UP
    if part.startswith(("index", "middle", "ring", "pinky", "thumb")):
        finger, joint = part.split("_")
        low, high = {"metacarpal": ("", "1"), "01": ("1", "2")}.get(joint, ("2", "3"))
        start = f"{hand}{finger.capitalize()}{low}" if low else hand
        along = _direction(rest_at, sources, start, f"{hand}{finger.capitalize()}{high}")
        return along, (-_UP - _FORWARD if finger == "thumb" else -_UP)
    pair = _SEGMENTS[part]
    prefix = {"l": "Left", "r": "Right", "": ""}[side]
    along = _direction(rest_at, sources, *(f"{prefix}{name}" for name in pair))
    return (-along if part in ("thigh", "calf") else along), -_FORWARD


_SEGMENTS = {
    "spine_01": ("Spine", "Spine1"), "spine_02": ("Spine", "Spine1"), "spine_03": ("Spine1", "Spine2"),
    "spine_04": ("Spine1", "Spine2"), "spine_05": ("Spine2", "Neck"), "neck_01": ("Neck", "Head"),
    "neck_02": ("Neck", "Head"), "clavicle": ("Shoulder", "Arm"), "upperarm": ("Arm", "ForeArm"),
    "lowerarm": ("ForeArm", "Hand"), "thigh": ("UpLeg", "Leg"), "calf": ("Leg", "Foot"),
}  # fmt: skip
"""Part -> HumanIK joints at its start and end, without their side."""


def _direction(
    rest_at: NDArray[np.float64], sources: dict[str, int], start: str, end: str
) -> NDArray[np.float64]:
    along = rest_at[sources[end]] - rest_at[sources[start]]
    return along / np.linalg.norm(along)
