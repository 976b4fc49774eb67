"""The mannequin: rounded parts spanned between joints of the output skeleton, and their placement for a pose.

Sizes are those of an adult of 1.75 m and scale with the performer's legs. A part lies between two points,
each a mix of joint positions plus an offset in a joint's axes, so that it follows any bone length and solve.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from studio.engine.geometry import matrices, quaternions
from studio.engine.joints import FINGERS, OUTPUT_INDEX, OUTPUT_JOINTS

BODY, JOINT = "body", "joint"
_REFERENCE_LEG_M = 0.84
_AXIS = {"x": 0, "y": 1, "z": 2}


@dataclass(frozen=True)
class Point:
    """A mix of joints (name -> weight) plus an offset [m] in the axes of the first of them."""

    mix: dict[str, float]
    offset: tuple[float, float, float] = (0.0, 0.0, 0.0)


@dataclass(frozen=True)
class Part:
    """One part: a unit shape of `shapes`, its tone, where it starts and ends, and its half-widths [m].

    `depth_axis` is the axis of `start`'s joint along which `deep` is measured; `wide` is across it.
    """

    shape: str
    tone: str
    start: Point
    end: Point
    wide: float
    deep: float
    depth_axis: str = "y"


@dataclass(frozen=True)
class Placement:
    """Where every part lies for one pose; a unit shape is scaled, turned, then moved.

    Attributes:
        positions_m: shape (part_count, 3).
        rotations: shape (part_count, 3, 3).
        scales_m: shape (part_count, 3).
    """

    positions_m: NDArray[np.float64]
    rotations: NDArray[np.float64]
    scales_m: NDArray[np.float64]

    @property
    def wxyz(self) -> NDArray[np.float64]:
        """Rotations as wxyz quaternions, shape (part_count, 4)."""
        return quaternions(self.rotations)


def _at(joint: str, x: float = 0.0, y: float = 0.0, z: float = 0.0) -> Point:
    return Point({joint: 1.0}, (x, y, z))


def _skull(y: float, z: float) -> Point:
    """A point of the head, wherever a solve puts its head joint between the skull's base and its middle."""
    return Point({"Head": 0.35, "Neck": 0.65}, (0.0, y, z))


def _ball(joint: str, wide: float, deep: float, high: float, y: float = 0.0, z: float = 0.0) -> Part:
    return Part("egg", JOINT, _at(joint, 0, y, z - high), _at(joint, 0, y, z + high), wide, deep)


def _trunk() -> list[Part]:
    return [
        Part("pelvis", BODY, _at("Hips", z=-0.12), _at("Hips", z=0.1), 0.162, 0.112),
        Part("egg", JOINT, _at("Hips", z=-0.02), _at("Spine2", z=0.02), 0.13, 0.092),
        Part("chest", BODY, _at("Spine1", z=-0.04), _at("Neck", z=0.022), 0.172, 0.114),
        Part("limb", JOINT, _at("Neck", y=0.012, z=-0.05), _skull(-0.004, 0.13), 0.058, 0.058),
        Part("head", BODY, _skull(-0.022, 0.04), _skull(-0.022, 0.285), 0.082, 0.103),
        Part("egg", JOINT, _skull(-0.093, 0.125), _skull(-0.093, 0.2), 0.058, 0.034),
    ]


def _arm(side: str) -> list[Part]:
    s = 1.0 if side == "Left" else -1.0
    arm, elbow, hand, middle = (f"{side}{name}" for name in ("Arm", "ForeArm", "Hand", "HandMiddle1"))
    parts = [
        Part("egg", BODY, _at("Neck", y=0.01, z=0.03), _at(arm, x=0.03 * s, z=0.0), 0.062, 0.06),
        _ball(arm, 0.058, 0.058, 0.058),
        Part("limb", BODY, _at(arm, x=0.005 * s), _at(elbow, x=-0.002 * s), 0.051, 0.051),
        _ball(elbow, 0.039, 0.039, 0.039),
        Part("limb", BODY, _at(elbow, x=0.005 * s), _at(hand, x=0.0), 0.043, 0.043),
        _ball(hand, 0.027, 0.03, 0.024),
        Part("palm", BODY, _at(hand, x=0.004 * s), _at(middle, x=0.012 * s), 0.043, 0.0175, "z"),
    ]
    for finger in FINGERS:
        radius = {"Thumb": 0.0125, "Pinky": 0.0085}.get(finger, 0.0095)
        a, b, c = (f"{side}Hand{finger}{k}" for k in (1, 2, 3))
        tip = Point({c: 1.85, b: -0.85})
        ends = [(_at(a), _at(b)), (_at(b), _at(c)), (_at(c), tip)]
        if finger == "Thumb":
            ends.insert(0, (_at(hand, x=0.012 * s), _at(b)))
        parts += [Part("finger", BODY, start, end, radius * (1.6 if i == 0 and finger == "Thumb" else 1.0),
                       radius * 1.0, "z") for i, (start, end) in enumerate(ends)]  # fmt: skip
    return parts


def _leg(side: str) -> list[Part]:
    hip, knee, ankle, toe = (f"{side}{name}" for name in ("UpLeg", "Leg", "Foot", "ToeBase"))
    return [
        _ball(hip, 0.08, 0.08, 0.08, z=-0.01),
        Part("limb", BODY, _at(hip, z=-0.005), _at(knee, z=-0.005), 0.083, 0.086),
        _ball(knee, 0.05, 0.052, 0.052),
        Part("limb", BODY, _at(knee, z=-0.005), _at(ankle, z=0.0), 0.053, 0.058),
        _ball(ankle, 0.036, 0.038, 0.036),
        Part("foot", BODY, _at(ankle, y=0.058, z=-0.036), _at(toe, y=-0.012, z=0.008), 0.045, 0.035, "z"),
        Part("foot", BODY, _at(toe, y=0.02, z=0.004), _at(toe, y=-0.07, z=0.0), 0.047, 0.0235, "z"),
    ]


PARTS: tuple[Part, ...] = (
    *_trunk(), *_arm("Left"), *_arm("Right"), *_leg("Left"), *_leg("Right"),
)  # fmt: skip
"""Every part of the mannequin."""


def _rows(points: list[Point]) -> tuple[NDArray[np.float64], NDArray[np.int64], NDArray[np.float64]]:
    """Mixing matrix (part, joint), index of the joint whose axes the offset is in, and the offsets."""
    mix = np.zeros((len(points), len(OUTPUT_JOINTS)))
    for row, point in enumerate(points):
        for name, weight in point.mix.items():
            mix[row, OUTPUT_INDEX[name]] = weight
    joints = np.array([OUTPUT_INDEX[next(iter(point.mix))] for point in points])
    return mix, joints, np.array([point.offset for point in points])


_START = _rows([part.start for part in PARTS])
_END = _rows([part.end for part in PARTS])
_DEPTH = np.array([_AXIS[part.depth_axis] for part in PARTS])
_WIDTHS = np.array([(part.wide, part.deep) for part in PARTS])
_LEGS = np.array(
    [[OUTPUT_INDEX[f"{s}{a}"], OUTPUT_INDEX[f"{s}{b}"]]
     for s in ("Left", "Right") for a, b in (("UpLeg", "Leg"), ("Leg", "Foot"))]
)  # fmt: skip


def body_scale(positions_m: NDArray[np.float64]) -> float:
    """Return the performer's size relative to an adult of 1.75 m, from the legs; positions (..., 52, 3)."""
    bones = np.linalg.norm(positions_m[..., _LEGS[:, 0], :] - positions_m[..., _LEGS[:, 1], :], axis=-1)
    return float(np.clip(np.median(bones.sum(axis=-1)) / 2 / _REFERENCE_LEG_M, 0.5, 1.4))


def place(positions_m: NDArray[np.float64], rotations_wxyz: NDArray[np.float64], scale: float) -> Placement:
    """Return where every part of `PARTS` lies.

    Args:
        positions_m: output joints in the stage frame, shape (52, 3), finite.
        rotations_wxyz: their world rotations, shape (52, 4).
        scale: of the body, see `body_scale`.
    """
    R = matrices(rotations_wxyz)
    start = _START[0] @ positions_m + scale * np.einsum("pij,pj->pi", R[_START[1]], _START[2])
    end = _END[0] @ positions_m + scale * np.einsum("pij,pj->pi", R[_END[1]], _END[2])
    along = end - start
    along[np.linalg.norm(along, axis=1) < 1e-4] = (0.0, 0.0, 1e-4)
    length = np.linalg.norm(along, axis=1)
    z = along / length[:, None]
    depth = R[_START[1], :, _DEPTH]
    x = np.cross(depth, z)
    degenerate = np.linalg.norm(x, axis=1) < 1e-3
    x[degenerate] = np.cross(z[degenerate][:, [1, 2, 0]] + (0.3, 0.5, 0.7), z[degenerate])
    x /= np.linalg.norm(x, axis=1)[:, None]
    rotations = np.stack([x, np.cross(z, x), z], axis=-1)
    scales = np.column_stack([_WIDTHS * scale, length])
    return Placement(positions_m=start, rotations=rotations, scales_m=scales)
