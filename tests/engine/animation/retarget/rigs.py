"""Rigs as other people make them: a target's bones with other proportions, in a T-pose or an A-pose, as files."""

from dataclasses import replace
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from studio.engine.animation.clip.skeleton import LocalMotion
from studio.engine.animation.export import EXPORTERS, ExportOptions, clip
from studio.engine.base.quaternions import multiply, rotate
from studio.engine.model.poses import Poses

BODIES: dict[str, dict[str, float]] = {
    "own": {},
    "child": {"": 0.55, "Leg": 0.85, "Arm": 0.9, "Hand": 0.9, "Neck": 1.3, "Head": 1.4},
    "long arms": {"Arm": 1.35, "Shoulder": 0.9},
    "short legs": {"Leg": 0.65, "Foot": 1.3},
    "giant": {"": 1.4, "Leg": 1.1, "Foot": 0.8, "Shoulder": 1.5},
}
"""Name -> factors of lengths: "" for all bones, then for the bones below a part's first joint."""

A_POSE = {"Arm": 45.0, "UpLeg": 8.0}
"""Degrees by which arms hang and legs spread in an A-pose."""

_PART_OF = {
    "ForeArm": "Arm", "Hand": "Arm", "Leg": "Leg", "Foot": "Leg", "ToeBase": "Foot", "Arm": "Shoulder",
    "UpLeg": "Hips", "Neck": "Neck", "Head": "Head",
}  # fmt: skip


def rig_motion(poses: Poses, target: str, body: str, a_pose: bool) -> LocalMotion:
    """Return two frames of a target's skeleton at rest, with a body's proportions, feet on the floor."""
    own = clip(poses, ExportOptions(target=target))
    factors = BODIES[body]
    offsets = own.offsets_m * factors.get("", 1.0)
    for joint, role in enumerate(own.roles):
        plain = role.removeprefix("Left").removeprefix("Right")
        part = "Hand" if plain.startswith("Hand") and plain != "Hand" else _PART_OF.get(plain, "")
        offsets[joint] *= factors.get(part, 1.0) if part else 1.0
    rest = own.rest_rotations_wxyz.copy()
    if a_pose:
        for side, sign in (("Left", -1.0), ("Right", 1.0)):
            for part, degrees in A_POSE.items():
                down = sign * degrees if part == "Arm" else -sign * degrees
                turn = Rotation.from_euler("z", down, degrees=True).as_quat(scalar_first=True)
                for joint in _below(own, own.roles.index(side + part)):
                    flat = part == "UpLeg" and own.roles[joint].endswith(("Foot", "ToeBase"))
                    rest[joint] = rest[joint] if flat else multiply(turn, rest[joint])
    root = own.offsets_m[0]
    motion = replace(own, offsets_m=offsets, rest_rotations_wxyz=rest, positions_m={}, name="Rest")
    feet = [j for j, role in enumerate(own.roles) if role.endswith("ToeBase")]
    lift = 0.02 * factors.get("", 1.0) - motion.rest_positions_m[feet, 1].min()
    hips = own.roles.index("Hips")
    above = motion.rest_rotations_wxyz[motion.parents[hips]] if hips else np.array([1.0, 0.0, 0.0, 0.0])
    offsets[hips] += rotate(above * [1, -1, -1, -1], np.array([0.0, lift, 0.0]))
    local = motion.rest_local_wxyz
    return replace(
        motion,
        offsets_m=offsets if hips == 0 else np.concatenate([root[None], offsets[1:]]),
        rotations_wxyz=np.repeat(local[None], 2, axis=0),
    )


def _below(motion: LocalMotion, joint: int) -> list[int]:
    out = [joint]
    for k in range(joint + 1, len(motion.parents)):
        if motion.parents[k] in out:
            out.append(k)
    return out


def write_rig(
    path: Path, poses: Poses, target: str = "humanik", body: str = "own", a_pose: bool = False
) -> Path:
    """Write a rig as a file of the format that its suffix names; return the file."""
    motion = rig_motion(poses, target, body, a_pose)
    format = path.suffix[1:]
    EXPORTERS[format].write(motion, path, ExportOptions(mesh=False))
    return path
