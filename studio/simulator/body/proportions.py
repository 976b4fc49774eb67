"""A performer's skeleton, and retargeting of a motion to it."""

import numpy as np
from numpy.typing import NDArray

from studio.engine.model.joints import CANONICAL, INDEX, PARENTS
from studio.simulator.body.bones import BONE
from studio.simulator.body.frame import SIDES, Frame
from studio.simulator.body.head import TOP_M, head_scale
from studio.simulator.body.performers import Actor
from studio.simulator.body.pose import bone_rotations

Array = NDArray[np.float64]
_FEET = [INDEX[f"{side}_{joint}"] for side in ("left", "right") for joint in ("ankle", "toe")]

# An adult of 1.75 m in the T-pose: each joint minus its parent, left side [m]. Segment lengths after Winter,
# "Biomechanics and Motor Control of Human Movement", figure 4.1, minus the distance from landmark to joint centre.
_ADULT_M: dict[str, tuple[float, float, float]] = {
    "spine": (0.0, 0.012, 0.105), "chest": (0.0, 0.014, 0.200), "neck": (0.0, 0.002, 0.246),
    "head": (0.0, -0.020, 0.106), "shoulder": (0.176, 0.008, 0.184), "elbow": (0.292, 0.0, 0.0),
    "wrist": (0.254, 0.0, 0.0), "hand": (0.090, 0.0, 0.0), "hip": (0.088, 0.0, -0.035),
    "knee": (0.0, 0.0, -0.426), "ankle": (0.0, 0.0, -0.404), "toe": (0.0, -0.136, -0.045),
}  # fmt: skip
_TOE_JOINT_M = 0.025


def performer_offsets(performer: Actor) -> Array:
    """Return the performer's T-pose offsets [m], shape (21, 3); see `CanonicalMotion`."""
    adult = np.zeros((len(CANONICAL), 3))
    for name, offset in _ADULT_M.items():
        if name in INDEX:
            adult[INDEX[name]] = offset
            continue
        change = {"knee": performer.legs, "ankle": performer.legs, "elbow": performer.arms, "wrist": performer.arms,
                  "hand": performer.arms}.get(name, 1.0)  # fmt: skip
        across = {"shoulder": performer.shoulders, "hip": performer.hips}.get(name, 1.0)
        for side, sign in SIDES:
            adult[INDEX[f"{side}_{name}"]] = change * np.array(offset) * [sign * across, 1.0, 1.0]
    size, offsets = performer.height_m / 1.75, adult
    for _ in range(10):  # the head grows less than the body
        offsets = adult * size
        offsets[0, 2] = _TOE_JOINT_M - sum(
            offsets[INDEX[f"left_{j}"], 2] for j in ("hip", "knee", "ankle", "toe")
        )
        frame = Frame.of(performer, offsets)
        size *= performer.height_m / (frame.joint("head")[2] + TOP_M * head_scale(frame))
    return offsets


def carried_over(positions_m: Array, offsets_m: Array, new_offsets_m: Array, turned: Array | None) -> Array:
    """Return joint positions retargeted to the body with `new_offsets_m`, shape (F, 21, 3).

    Bones turn as in the motion. The path of the hips scales with the legs. The lower foot stands on the floor at
    its 2nd percentile.

    Args:
        positions_m: of the body with `offsets_m`, shape (F, 21, 3).
        offsets_m, new_offsets_m: T-pose offsets, shape (21, 3).
        turned: see `bone_rotations`.
    """
    turns = bone_rotations(positions_m, offsets_m, turned, whole_clavicle=True)
    bone = {"spine": "pelvis", "chest": "spine", "neck": "chest", "head": "neck"}
    for side, _ in SIDES:
        bone |= {f"{side}_{joint}": f"{side}_{name}" for joint, name in (
            ("shoulder", "clavicle"), ("elbow", "upper_arm_end"), ("wrist", "forearm"), ("hand", "hand"),
            ("knee", "thigh_end"), ("ankle", "shin"), ("toe", "foot"))}  # fmt: skip
        bone[f"{side}_hip"] = "pelvis"
    out = np.empty_like(positions_m)
    out[:, 0] = positions_m[:, 0] * (_leg(new_offsets_m) / _leg(offsets_m))
    for i, parent in enumerate(PARENTS):
        if parent >= 0:
            out[:, i] = out[:, parent] + turns[:, BONE[bone[CANONICAL[i]]]] @ new_offsets_m[i]
    out[..., 2] -= np.percentile(out[:, _FEET, 2].min(axis=1), 2) - _TOE_JOINT_M
    return out


def _leg(offsets: Array) -> float:
    return float(-sum(offsets[INDEX[f"left_{joint}"], 2] for joint in ("knee", "ankle", "toe")))
