"""The output skeleton of a performer at rest, and its forward kinematics.

Rest offsets come from the performer's measured canonical joints. Joints that no camera measures (the lowest joint of
the spine, the clavicles, the fingers) are placed by proportion.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from studio.engine.model.calibration import Performer
from studio.engine.model.joints import (
    CANONICAL,
    FINGERS,
    INDEX,
    OUTPUT_INDEX,
    OUTPUT_JOINTS,
    OUTPUT_OF_CANONICAL,
    OUTPUT_PARENTS,
)

# The clavicle's inner end as a share of the way from the chest to the shoulder, across, back and up: the
# sternoclavicular joint lies near the midline at the height of the shoulder's top.
_CLAVICLE_SHARE = np.array([0.15, 0.5, 0.8])

# The lowest joint of the spine (L5/S1) lies this far above the hip joints' centres, as a share of stature: 0.084 m
# of 1.75, the mean of men's 0.076 and women's 0.092 (Dumas, Cheze, Verriest, "Adjustments to McConville et al. and
# Young et al. body segment inertial parameters", J. Biomech. 2007). Between the hips and the measured spine joint it
# is clamped to these shares, so that both bones have a length.
_LUMBOSACRAL_OF_HEIGHT = 0.048
_LUMBOSACRAL_SHARE = (0.2, 0.6)

# Knuckles and phalanges as shares of the hand's length (wrist to tip of the middle finger, 10.8 % of stature:
# Drillis & Contini 1966): knuckle along the hand and towards the thumb, then the three bones of the finger.
# Ratios of the bones: Alexander & Viktora, "Long bones of the hand", 2010.
_FINGER_TABLE: dict[str, tuple[float, float, tuple[float, float, float]]] = {
    "Thumb": (0.12, 0.14, (0.22, 0.17, 0.14)),
    "Index": (0.50, 0.13, (0.21, 0.13, 0.10)),
    "Middle": (0.51, 0.02, (0.23, 0.15, 0.11)),
    "Ring": (0.48, -0.08, (0.21, 0.14, 0.10)),
    "Pinky": (0.44, -0.17, (0.17, 0.10, 0.09)),
}
HAND_LENGTH_OF_HEIGHT = 0.108
_THUMB_DIRECTION = np.array([0.70, -0.66, -0.27])  # left hand, T-pose: outward, forward and a little down


def _lumbosacral_share(measured: dict[str, NDArray[np.float64]], height_m: float) -> float:
    """Position of the spine's lowest joint between the hips and the measured spine joint, 0..1."""
    hips_above_legs = -0.5 * float(measured["left_hip"][2] + measured["right_hip"][2])
    way = max(float(np.linalg.norm(measured["spine"])), 1e-6)
    return float(np.clip((_LUMBOSACRAL_OF_HEIGHT * height_m - hips_above_legs) / way, *_LUMBOSACRAL_SHARE))


def _finger_offsets(
    side: str, hand_length: float, knuckle: NDArray[np.float64]
) -> dict[str, NDArray[np.float64]]:
    """Offsets of one hand's finger joints; `knuckle` is the measured base of the middle finger in the hand."""
    x = 1.0 if side == "Left" else -1.0
    offsets: dict[str, NDArray[np.float64]] = {}
    for finger in FINGERS:
        along, across, bones = _FINGER_TABLE[finger]
        base = np.array([x * along, -across, 0.0]) * hand_length
        if finger == "Middle":
            base = knuckle
        elif finger != "Thumb":
            base = knuckle + base - np.array([x * _FINGER_TABLE["Middle"][0], -0.02, 0.0]) * hand_length
        direction = np.array([x, 1.0, 1.0]) * (_THUMB_DIRECTION if finger == "Thumb" else [1.0, 0.0, 0.0])
        name = f"{side}Hand{finger}"
        offsets[f"{name}1"] = base
        for k in (2, 3):
            offsets[f"{name}{k}"] = direction / np.linalg.norm(direction) * bones[k - 2] * hand_length
    return offsets


@dataclass(frozen=True)
class Skeleton:
    """The output skeleton at rest.

    Attributes:
        offsets_m: T-pose position of each output joint minus its parent's, stage axes, shape (52, 3); the
            hips' row is their T-pose position (0, 0, height above the floor).
        height_m: the performer's stature.
    """

    offsets_m: NDArray[np.float64]
    height_m: float

    @classmethod
    def of(cls, performer: Performer) -> "Skeleton":
        """Return the skeleton of a performer's proportions."""
        measured = {name: performer.offsets_m[INDEX[name]] for name in CANONICAL}
        offsets = np.zeros((len(OUTPUT_JOINTS), 3))
        for name, output in OUTPUT_OF_CANONICAL.items():
            offsets[OUTPUT_INDEX[output]] = measured[name]
        offsets[OUTPUT_INDEX["Hips"]] = (0.0, 0.0, measured["hips"][2])
        lowest = _lumbosacral_share(measured, performer.height_m)
        offsets[OUTPUT_INDEX["Spine"]] = lowest * measured["spine"]
        offsets[OUTPUT_INDEX["Spine1"]] = (1.0 - lowest) * measured["spine"]
        hand_length = HAND_LENGTH_OF_HEIGHT * performer.height_m
        for side in ("Left", "Right"):
            shoulder = measured[f"{side.lower()}_shoulder"]
            clavicle = _CLAVICLE_SHARE * shoulder
            offsets[OUTPUT_INDEX[f"{side}Shoulder"]] = clavicle
            offsets[OUTPUT_INDEX[f"{side}Arm"]] = shoulder - clavicle
            fingers = _finger_offsets(side, hand_length, measured[f"{side.lower()}_hand"])
            for name, offset in fingers.items():
                offsets[OUTPUT_INDEX[name]] = offset
        return cls(offsets, performer.height_m)

    def finger_tip_m(self, joint: str) -> NDArray[np.float64]:
        """Return the position of a fingertip from the finger's last joint (such as `LeftHandIndex3`), in the T-pose
        [m]."""
        last_bone = self.offsets_m[OUTPUT_INDEX[joint]]
        finger = joint.removeprefix("Left").removeprefix("Right").removeprefix("Hand")[:-1]
        length = _FINGER_TABLE[finger][2][2] * HAND_LENGTH_OF_HEIGHT * self.height_m
        return last_bone * (length / np.linalg.norm(last_bone))

    @cached_property
    def rest_positions_m(self) -> NDArray[np.float64]:
        """T-pose joint positions [m], shape (52, 3)."""
        positions = self.offsets_m.copy()
        for joint, parent in enumerate(OUTPUT_PARENTS):
            if parent >= 0:
                positions[joint] += positions[parent]
        return positions


def _levels() -> list[NDArray[np.int64]]:
    """Output joints below the hips, grouped by depth."""
    depth = np.zeros(len(OUTPUT_JOINTS), dtype=np.int64)
    for joint, parent in enumerate(OUTPUT_PARENTS):
        depth[joint] = 0 if parent < 0 else depth[parent] + 1
    return [np.flatnonzero(depth == level) for level in range(1, depth.max() + 1)]


def _ways() -> NDArray[np.float64]:
    """1 where a joint (row) is another (column) or its descendant, shape (52, 52)."""
    ways = np.eye(len(OUTPUT_JOINTS))
    for joint, parent in enumerate(OUTPUT_PARENTS):
        if parent >= 0:
            ways[joint] += ways[parent]
    return ways


_LEVELS = _levels()
_WAYS = _ways()
_NON_ROOT = np.arange(1, len(OUTPUT_JOINTS))
_CARRIERS = OUTPUT_PARENTS[_NON_ROOT]


def forward_positions(
    skeleton: Skeleton, root: NDArray[np.float64], rotations: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return joint positions [m], shape (52, 3), of world rotations, shape (52, 3, 3), and the hips' position."""
    steps = np.empty((len(OUTPUT_JOINTS), 3))
    steps[0] = root
    np.vecdot(rotations.take(_CARRIERS, axis=0), skeleton.offsets_m[1:, None], out=steps[1:])
    return _WAYS @ steps


def local_rotations(rotations: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return each joint's rotation in its parent, shape (52, 3, 3), of world rotations; the root keeps its own."""
    local = rotations.copy()
    parents = rotations[_CARRIERS]
    local[_NON_ROOT] = np.einsum("jba,jbc->jac", parents, rotations[_NON_ROOT])
    return local


def world_rotations(local: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return world rotations, shape (52, 3, 3), of rotations in the parent."""
    world = local.copy()
    for level in _LEVELS:
        world[level] = world[OUTPUT_PARENTS[level]] @ local[level]
    return world
