"""One frame of the output skeleton in the axes of Unity: left-handed, metres, y up, the performer facing +z.

A point (x, y, z) of the stage is (-x, z, -y) in Unity. Rotations are mirrored with the axes: a T-pose stays the
identity.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from studio.engine.base.quaternions import inverse, multiply, rotate
from studio.engine.model.joints import OUTPUT_INDEX, OUTPUT_JOINTS, OUTPUT_PARENTS

ROOT = OUTPUT_INDEX["Hips"]
_PARENTS = np.where(OUTPUT_PARENTS < 0, 0, OUTPUT_PARENTS)
_IS_ROOT = OUTPUT_PARENTS < 0

_BODY = {
    "Hips": "Hips", "Spine": "Spine", "Spine1": "Chest", "Spine2": "UpperChest", "Neck": "Neck", "Head": "Head",
}  # fmt: skip
_LIMBS = {
    "Shoulder": "Shoulder", "Arm": "UpperArm", "ForeArm": "LowerArm", "Hand": "Hand",
    "UpLeg": "UpperLeg", "Leg": "LowerLeg", "Foot": "Foot", "ToeBase": "Toes",
}  # fmt: skip
_PHALANGES = {"1": "Proximal", "2": "Intermediate", "3": "Distal"}


def _unity_name(joint: str) -> str:
    if joint in _BODY:
        return _BODY[joint]
    side = "Left" if joint.startswith("Left") else "Right"
    part = joint.removeprefix(side)
    if part in _LIMBS:
        return side + _LIMBS[part]
    finger, phalanx = part.removeprefix("Hand")[:-1], part[-1]
    return side + {"Pinky": "Little"}.get(finger, finger) + _PHALANGES[phalanx]


UNITY_BONES: tuple[str, ...] = tuple(_unity_name(joint) for joint in OUTPUT_JOINTS)
"""Unity's name (`HumanBodyBones`) of every output joint, shape (52,)."""


@dataclass(frozen=True)
class UnityPose:
    """A frame in Unity's axes.

    Attributes:
        time_s: stage time [s].
        positions_m: world positions, shape (52, 3).
        rotations_wxyz: world rotations, shape (52, 4); the identity in the T-pose.
        local_positions_m: positions in the parent's axes, shape (52, 3); the root's are its world position.
        local_rotations_wxyz: rotations in the parent's axes, shape (52, 4).
    """

    time_s: float
    positions_m: NDArray[np.float64]
    rotations_wxyz: NDArray[np.float64]
    local_positions_m: NDArray[np.float64]
    local_rotations_wxyz: NDArray[np.float64]


def unity_pose(
    time_s: float, positions_m: NDArray[np.float64], rotations_wxyz: NDArray[np.float64], scale: float = 1.0
) -> UnityPose:
    """Return a frame of poses in Unity's axes.

    Args:
        time_s: time of the frame [s].
        positions_m: stage frame, shape (52, 3).
        rotations_wxyz: world rotations in the stage frame, shape (52, 4).
        scale: positions are multiplied by this.
    """
    positions = np.stack([-positions_m[:, 0], positions_m[:, 2], -positions_m[:, 1]], axis=-1) * scale
    w, x, y, z = rotations_wxyz.T
    rotations = np.stack([w, x, -z, y], axis=-1)
    back = inverse(rotations[_PARENTS])
    local_rotations = multiply(back, rotations)
    local_positions = rotate(back, positions - positions[_PARENTS])
    local_rotations[_IS_ROOT], local_positions[_IS_ROOT] = rotations[_IS_ROOT], positions[_IS_ROOT]
    return UnityPose(time_s, positions, rotations, local_positions, local_rotations)
