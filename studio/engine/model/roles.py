"""Recognises the joints of a foreign skeleton: HumanIK roles by name and by place in the tree.

It knows the names of HumanIK, Mixamo, Unreal, VRM and Unity, CMU (BVH and ASF), Kinect, Xsens, Rokoko, 3ds Max
Biped and DAZ, with or without a namespace or a prefix.
"""

import re
from collections.abc import Sequence

from studio.engine.model.joints import FINGERS

_PREFIXES = (
    "mixamorig",
    "character",
    "bip",
    "jbipc",
    "jbip",
    "jsec",
    "valvebiped",
    "ccbase",
    "def",
    "org",
    "b",
)
_SIDES = {"left": "Left", "l": "Left", "lf": "Left", "right": "Right", "r": "Right", "rt": "Right"}

_MIDDLE: dict[str, tuple[str, ...]] = {
    "Hips": ("hips", "hip", "pelvis", "spinebase", "hipcenter", "root"),
    "Neck": ("neck", "neck1", "neck01", "lowerneck", "necklower", "shouldercenter"),
    "Head": ("head",),
}
_SIDED: dict[str, tuple[str, ...]] = {
    "Arm": ("arm", "upperarm", "uparm", "shldr", "shldrbend", "humerus", "shoulder"),
    "ForeArm": ("forearm", "lowerarm", "lowarm", "forearmbend", "elbow", "radius"),
    "Hand": ("wrist", "hand"),
    "UpLeg": ("upleg", "thigh", "upperleg", "thighbend", "femur", "hip"),
    "Leg": ("leg", "shin", "calf", "lowerleg", "lowleg", "knee", "tibia"),
    "Foot": ("ankle", "foot"),
    "ToeBase": ("toebase", "toe", "toes", "toe0", "ball"),
    "Shoulder": ("shoulder", "clavicle", "collar", "clav"),
}
"""Role without its side -> joint names without their side, most certain first. A clavicle is also called a
shoulder."""

_FINGER_WORDS = {"thumb": "Thumb", "index": "Index", "middle": "Middle", "mid": "Middle", "ring": "Ring",
                 "pinky": "Pinky", "little": "Pinky", "small": "Pinky"}  # fmt: skip
_ONE_LETTER = re.compile(
    "[lr](hip|femur|tibia|foot|toes|clavicle|humerus|radius|wrist|hand|fingers|thumb|thigh|shin|shldr|collar|"
    "forearm|hipjoint)"
)
"""Names of one word after the letter of their side, as in CMU's ASF files."""

_NUMBERED = re.compile(r"finger(\d)")
_NOT_BONES = ("twist", "roll", "ik", "end", "site", "nub", "tip", "socket", "helper", "ctrl", "joint")


def roles_of(names: Sequence[str], parents: Sequence[int]) -> tuple[str, ...]:
    """Return the HumanIK name of each joint, "" where unknown, shape (joint_count,).

    Spine joints are recognised by their place between hips and neck, finger joints by their order.

    Args:
        names: as in the file.
        parents: index of each joint's parent, negative for a root.
    """
    words = [_words(name) for name in names]
    cores: dict[tuple[str, str], int] = {}
    for joint, (side, core) in enumerate(words):
        cores.setdefault((side, core), joint)
    found: dict[str, int] = {}
    for role, options in _MIDDLE.items():
        _take(found, role, [cores.get(("", core)) for core in options])
    for side in ("Left", "Right"):
        for role, options in _SIDED.items():
            _take(found, side + role, [cores.get((side, core)) for core in options])
        _take(found, f"{side}ToeBase", [cores.get((side, "foot"))])  # their ankle has another name
        found.update(_fingers(words, parents, side))
        _take(found, f"{side}HandMiddle1", [cores.get((side, core)) for core in ("hand", "fingers", "palm")])
    found.update(_spine(found, parents))
    roles = [""] * len(names)
    for role, joint in found.items():
        roles[joint] = roles[joint] or role
    return tuple(roles)


def _take(found: dict[str, int], role: str, joints: list[int | None]) -> None:
    """Give a role to the first of these joints that has none yet."""
    if role not in found:
        free = [joint for joint in joints if joint is not None and joint not in found.values()]
        if free:
            found[role] = free[0]


def _words(name: str) -> tuple[str, str]:
    """Return the side and the rest of a name: `mixamorig:LeftArm`, `upperarm_l`, `lShldr` -> (Left, arm...)."""
    name = re.split(r"[:|]", name)[-1]
    name = re.sub(r"([a-z0-9])([A-Z])", r"\1 \2", name)
    name = re.sub(r"([A-Z])([A-Z][a-z])", r"\1 \2", name)
    words = [word for word in re.split(r"[^a-z0-9]+", name.lower()) if word]
    while len(words) > 1 and (re.sub(r"\d+$", "", words[0]) in _PREFIXES or words[0] in ("j", "sec")):
        words = words[1:]
    side = ""
    for place, word in enumerate(words):
        whole = next(
            (full for full in ("left", "right") if word.startswith(full) or word.endswith(full)), None
        )
        if word in _SIDES and len(words) > 1:
            side = _SIDES[word]
            words = words[:place] + words[place + 1 :]
            break
        if whole is not None and word != whole:
            side = _SIDES[whole]
            words = [*words[:place], word.replace(whole, "", 1), *words[place + 1 :]]
            break
    if not side and words and _ONE_LETTER.fullmatch(words[0]):
        side, words = _SIDES[words[0][0]], [words[0][1:], *words[1:]]
    if len(words) > 1:  # J_Bip_C_Head: C is for centre
        words = [word for word in words if word != "c"]
    return side, "".join(words)


def _fingers(words: list[tuple[str, str]], parents: Sequence[int], side: str) -> dict[str, int]:
    """Return the finger joints of one hand by role: the first three of each finger, without a metacarpal."""
    chains: dict[str, list[int]] = {finger: [] for finger in FINGERS}
    for joint, (own, core) in enumerate(words):
        if own != side or core.startswith("toe") or any(core.endswith(word) for word in _NOT_BONES):
            continue
        numbered = _NUMBERED.search(core)
        finger = next((full for word, full in _FINGER_WORDS.items() if word in core), None)
        if finger is None and numbered:
            finger = _numbered(int(numbered[1]), words, side)
        if finger is not None:
            chains[finger].append(joint)
    found = {}
    for finger, joints in chains.items():
        joints.sort(key=lambda joint: _depth(parents, joint))
        if finger != "Thumb" and len(joints) > 3:
            joints = [joint for joint in joints if "meta" not in words[joint][1]]
        found.update({f"{side}Hand{finger}{k}": joint for k, joint in enumerate(joints[:3], 1)})
    return found


def _numbered(number: int, words: list[tuple[str, str]], side: str) -> str | None:
    """The finger with this number: Biped counts the thumb as 0, others as 1."""
    first = 0 if any(own == side and core.startswith("finger0") for own, core in words) else 1
    return FINGERS[number - first] if 0 <= number - first < len(FINGERS) else None


def _depth(parents: Sequence[int], joint: int) -> int:
    depth = 0
    while parents[joint] >= 0:
        joint, depth = int(parents[joint]), depth + 1
    return depth


def _spine(found: dict[str, int], parents: Sequence[int]) -> dict[str, int]:
    """Return the first, a middle and the last joint between the hips and the neck."""
    end = found.get("Neck", found.get("Head"))
    if end is None or "Hips" not in found:
        return {}
    chain: list[int] = []
    joint = int(parents[end])
    while joint >= 0 and joint != found["Hips"]:
        chain.append(joint)
        joint = int(parents[joint])
    if joint < 0:
        return {}
    chain = [joint for joint in reversed(chain) if joint not in found.values()]
    if len(chain) < 3:
        return dict(zip(("Spine", "Spine2"), chain, strict=False))
    return {"Spine": chain[0], "Spine1": chain[len(chain) // 2], "Spine2": chain[-1]}
