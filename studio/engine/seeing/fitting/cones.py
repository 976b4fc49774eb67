"""The tracker's model of the performer's surface: rounded cones on the bones of the humanoid.

Lengths and radii are shares of stature. Sources: ANSUR: Gordon et al., "2012 Anthropometric Survey of U.S. Army
Personnel", NATICK/TR-15/007, 2014, means of men and women; lengths of bones are those of `calibration.proportions`
(Drillis & Contini 1966). The depth of joint centres under the skin is from the literature: the hip joints 0.104
apart (Bell, Pedersen & Brand 1990) and in front of the middle of the pelvis's depth; the humeral head's middle a
centimetre inside the acromion's edge (half of the biacromial breadth, 0.115, ANSUR; Nyffeler et al., "Association of
a large lateral extension of the acromion with rotator cuff tears", JBJS 2006). Upper arms and forearms reach from
joint centre to joint centre: de Leva, "Adjustments to Zatsiorsky-Seluyanov's segment inertia parameters",
J. Biomechanics 29, 1996, means of men and women.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from studio.engine.model.calibration import Performer
from studio.engine.model.human.anthropometry import ANKLE_HEIGHT, TOP_OF_HEAD, anthropometric_positions
from studio.engine.model.human.humanoid import BODY_JOINTS, Humanoid, build_humanoid
from studio.engine.model.human.skeleton import Skeleton
from studio.engine.model.joints import (
    CANONICAL,
    INDEX,
    OUTPUT_INDEX,
    OUTPUT_OF_CANONICAL,
    PARENTS,
)

Array = NDArray[np.float64]
Triple = tuple[float, float, float]

PARTS: tuple[str, ...] = ("trunk", "left_arm", "right_arm", "left_leg", "right_leg")
"""Parts of the body that the tracker treats separately; head and neck belong to the trunk."""

SHAPE: tuple[str, ...] = (
    "height", "leg", "arm", "shoulder", "trunk", "trunk_girth", "arm_girth", "leg_girth", "hip", "elbow", "knee",
    "head", "cloth",
)  # fmt: skip
"""Parameters of a body's shape, each the logarithm of a scale: height; length of legs, of arms; width of shoulders;
length of the trunk; girths; distance of the hip joints; upper arm to forearm, and thigh to shank, at constant length;
size of the head; distance of clothes from the skin.
"""

SHAPE_SPREAD: Array = np.array([0.05, 0.03, 0.035, 0.06, 0.03, 0.10, 0.12, 0.10, 0.10, 0.06, 0.04, 0.04, 0.8])
"""Standard deviation of each parameter among people of one stature: ANSUR's variation without that of stature;
clothes from tight to wide.
"""

SHAPE_REACH: Array = np.array([0.25] * 12 + [1.2])
"""Largest deviation of each parameter from its usual value, except height."""

CLOTH = 0.0055
"""Usual distance of clothes from the skin."""
_CLOTHED = {"Head": 0.0, "Neck": 0.0, "Hand": 0.0, "Foot": 0.0, "ToeBase": 0.0, "ForeArm": 0.5}
"""Share of that distance by body, where it is not 1: heads, hands and shoes have none; sleeves are often short."""

USUAL_HEIGHT_M = 1.72
_SHOULDER_HALF_WIDTH = 0.110


@dataclass(frozen=True)
class Cone:
    """A rounded cone on a body: its ends from the body's joint and its radii, as shares of stature.

    `flat` is its extent along `across` (in the T-pose) divided by its extent perpendicular to that.
    """

    body: str
    start: Triple
    end: Triple
    start_radius: float
    end_radius: float
    girth: str
    flat: float = 1.0
    across: Triple = (1.0, 0.0, 0.0)


_LEFT_AND_RIGHT = (
    # Trunk: two columns side by side; ANSUR hip breadth 0.205, buttock depth 0.142, waist breadth 0.18 and depth
    # 0.135, chest breadth 0.161 and depth 0.147, of soldiers: a tenth less for people of usual mass.
    Cone("Hips", (0.040, 0.010, 0.005), (0.038, 0.006, 0.070), 0.058, 0.052, "trunk_girth"),
    Cone("Spine", (0.036, 0.004, 0.015), (0.034, 0.004, 0.072), 0.051, 0.052, "trunk_girth"),
    Cone("Spine1", (0.033, 0.004, 0.060), (0.033, 0.004, 0.160), 0.052, 0.056, "trunk_girth"),
    Cone("Spine2", (0.033, 0.002, 0.000), (0.040, 0.004, 0.025), 0.056, 0.046, "trunk_girth"),
    # Shoulder: the deltoid, and the part between it and the neck.
    Cone("LeftShoulder", (0.010, 0.000, 0.005), (0.090, 0.000, -0.002), 0.036, 0.032, "trunk_girth"),
    # Arm: biceps 0.197, forearm 0.170 and wrist 0.098 round (ANSUR, flexed; relaxed a twentieth less).
    Cone("LeftArm", (0.000, 0.0, 0.0), (0.160, 0.0, 0.0), 0.031, 0.0235, "arm_girth"),
    Cone("LeftForeArm", (0.000, 0.0, 0.0), (0.058, 0.0, 0.0), 0.0235, 0.0255, "arm_girth"),
    Cone("LeftForeArm", (0.058, 0.0, 0.0), (0.153, 0.0, 0.0), 0.0255, 0.0155, "arm_girth"),
    # Hand: 0.050 broad and 0.11 long; thickness of the palm 0.017 (Garrett, "The adult human hand", 1971).
    Cone("LeftHand", (0.008, 0.0, 0.0), (0.045, 0.0, 0.0), 0.018, 0.023, "arm_girth", 1.7, (0.0, 1.0, 0.0)),
    Cone("LeftHand", (0.052, 0.0, 0.0), (0.090, 0.0, 0.0), 0.020, 0.012, "arm_girth", 1.9, (0.0, 1.0, 0.0)),
    # Leg: thigh 0.367, above the knee 0.24, calf 0.226 and ankle 0.131 round (ANSUR).
    Cone("LeftUpLeg", (0.000, 0.004, -0.010), (0.0, 0.0, -0.245), 0.051, 0.034, "leg_girth"),
    Cone("LeftLeg", (0.000, 0.000, 0.000), (0.0, 0.006, -0.080), 0.033, 0.0335, "leg_girth"),
    Cone("LeftLeg", (0.000, 0.006, -0.080), (0.0, 0.002, -0.235), 0.0335, 0.0195, "leg_girth"),
    # Foot: 0.153 long, 0.058 broad (ANSUR); the ankle a quarter of its length in front of the heel.
    Cone("LeftFoot", (0.0, 0.018, -0.020), (0.0, -0.060, -0.024), 0.021, 0.023, "leg_girth", 1.5),
    Cone("LeftFoot", (0.0, 0.000, -0.004), (0.0, -0.040, -0.020), 0.020, 0.016, "leg_girth"),
    Cone("LeftToeBase", (0.0, 0.0, 0.002), (0.0, -0.028, -0.002), 0.023, 0.018, "leg_girth", 1.7),
)  # fmt: skip

_MIDDLE = (
    Cone("Spine2", (0.0, 0.010, 0.030), (0.0, 0.010, 0.060), 0.052, 0.036, "trunk_girth"),
    # Neck 0.215 round; head 0.089 broad, 0.115 long and 0.131 high (ANSUR).
    Cone("Neck", (0.0, 0.004, 0.000), (0.0, -0.002, 0.050), 0.033, 0.031, "trunk_girth"),
    Cone("Head", (0.0, -0.008, -0.012), (0.0, -0.004, 0.020), 0.043, 0.045, "head", 0.80),
    Cone("Head", (0.0, -0.030, -0.046), (0.0, -0.026, -0.020), 0.022, 0.030, "head"),
)


class Surface(NamedTuple):
    """The rounded cones of one body, in metres, in the frames of their bodies.

    Attributes:
        body: of each cone, shape (cone_count,).
        part: index in `PARTS`, shape (cone_count,).
        number: index of the cone in the whole body, shape (cone_count,).
        origin: start of its axis, shape (cone_count, 3).
        frame: columns are `across`, the perpendicular direction, and the axis, shape (cone_count, 3, 3).
        length, start_radius, end_radius, flat: shape (cone_count,).
    """

    body: NDArray[np.int64]
    part: NDArray[np.int64]
    number: NDArray[np.int64]
    origin: Array
    frame: Array
    length: Array
    start_radius: Array
    end_radius: Array
    flat: Array


def _mirrored(cone: Cone) -> Cone:
    def flip(v: Triple) -> Triple:
        return (-v[0], v[1], v[2])

    body = "Right" + cone.body.removeprefix("Left") if cone.body.startswith("Left") else cone.body
    return Cone(
        body, flip(cone.start), flip(cone.end), cone.start_radius, cone.end_radius, cone.girth, cone.flat,
        flip(cone.across),
    )  # fmt: skip


CONES: tuple[Cone, ...] = (*_MIDDLE, *_LEFT_AND_RIGHT, *(_mirrored(cone) for cone in _LEFT_AND_RIGHT))


def part_of(body: str) -> int:
    """Return the index in `PARTS` of an output joint."""
    for side in ("Left", "Right"):
        if body.startswith(side) and body != f"{side}Shoulder":
            limb = "leg" if body.removeprefix(side) in ("UpLeg", "Leg", "Foot", "ToeBase") else "arm"
            return PARTS.index(f"{side.lower()}_{limb}")
    return 0


_UPPER_ARM, _FOREARM, _THIGH, _SHANK = 0.160, 0.153, 0.245, 0.246
_NECK = np.array([0.0, 0.0, 0.040])
"""From the neck's joint to the height of the chin; the scale of the head applies from there to the middle of the
head."""


def _scales(shape: Array) -> dict[str, float]:
    """Return the scales by name of `SHAPE`, and of the halves of arms and legs, whose sum is constant."""
    scale = dict(zip(SHAPE, np.exp(shape), strict=True))
    out = {
        name: float(value * (1.0 if name == "height" else scale["height"])) for name, value in scale.items()
    }
    for joint, limb, near, far, lengths in (
        ("elbow", "arm", "upper_arm", "forearm", (_UPPER_ARM, _FOREARM)),
        ("knee", "leg", "thigh", "shank", (_THIGH, _SHANK)),
    ):
        share = lengths[0] * scale[joint] / (lengths[0] * scale[joint] + lengths[1])
        out[near] = out[limb] * share * sum(lengths) / lengths[0]
        out[far] = out[limb] * (1.0 - share) * sum(lengths) / lengths[1]
    return out


_OFFSET_SCALES = {"elbow": "upper_arm", "wrist": "forearm", "hand": "arm", "knee": "thigh", "ankle": "shank",
                  "toe": "height"}  # fmt: skip


def performer_of(shape: Array) -> Performer:
    """Return the proportions of a shape, shape (13,)."""
    scale = {name: value * USUAL_HEIGHT_M for name, value in _scales(shape).items()}
    offsets = _USUAL_OFFSETS.copy()
    for side in ("left", "right"):
        offsets[INDEX[f"{side}_shoulder"]] *= np.array([scale["shoulder"], scale["trunk"], scale["trunk"]])
        offsets[INDEX[f"{side}_hip"]] *= np.array([scale["hip"], scale["height"], scale["height"]])
        for name, key in _OFFSET_SCALES.items():
            offsets[INDEX[f"{side}_{name}"]] *= scale[key]
    for name in ("spine", "chest", "neck"):
        offsets[INDEX[name]] *= scale["trunk"]
    offsets[INDEX["head"]] = _NECK * scale["height"] + (offsets[INDEX["head"]] - _NECK) * scale["head"]
    legs = offsets[INDEX["left_ankle"], 2] + offsets[INDEX["left_knee"], 2]
    offsets[0] = [0.0, 0.0, ANKLE_HEIGHT * scale["height"] - legs]
    head_over_hips = offsets[[INDEX[n] for n in ("spine", "chest", "neck", "head")], 2].sum()
    height = float(offsets[0, 2] + head_over_hips + TOP_OF_HEAD * scale["head"])
    return Performer(height_m=height, offsets_m=offsets)


def _usual_offsets() -> Array:
    usual = anthropometric_positions(1.0)
    offsets = usual - usual[np.maximum(PARENTS, 0)]
    for side, sign in (("left", 1.0), ("right", -1.0)):
        offsets[INDEX[f"{side}_shoulder"], 0] = sign * _SHOULDER_HALF_WIDTH
        offsets[INDEX[f"{side}_elbow"], 0] = sign * _UPPER_ARM
        offsets[INDEX[f"{side}_wrist"], 0] = sign * _FOREARM
    return offsets


_USUAL_OFFSETS = _usual_offsets()


def offsets_of(shape: Array) -> Array:
    """Return the offset of each body from its parent in the T-pose [m], shape (body_count, 3)."""
    skeleton = Skeleton.of(performer_of(shape))
    return skeleton.offsets_m[[OUTPUT_INDEX[name] for name in BODY_JOINTS]].copy()


_LENGTH_KEYS = {"Spine": "trunk", "Spine1": "trunk", "Spine2": "trunk", "LeftShoulder": "shoulder",
                "LeftArm": "upper_arm", "LeftForeArm": "forearm", "LeftHand": "arm", "LeftUpLeg": "thigh",
                "LeftLeg": "shank", "Head": "head"}  # fmt: skip


def _axis_keys(cone: Cone) -> tuple[str, str, str]:
    """Return the scales of a cone's axis along x, y and z."""
    length = _LENGTH_KEYS.get(cone.body.replace("Right", "Left"), "height")
    if cone.body.endswith("Shoulder"):
        return length, cone.girth, cone.girth
    return (cone.girth, cone.girth, length) if part_of(cone.body) == 0 else (length, length, length)


CONE_COUNT = len(CONES)
_STARTS = np.array([cone.start for cone in CONES])
_AXES = np.array([cone.end for cone in CONES]) - _STARTS
_RADII = np.array([(cone.start_radius, cone.end_radius) for cone in CONES])
_ACROSS = np.array([cone.across for cone in CONES])
_BODIES = np.array([BODY_JOINTS.index(cone.body) for cone in CONES])
_CONE_PARTS = np.array([part_of(cone.body) for cone in CONES])
_FLAT = np.array([cone.flat for cone in CONES])
_CLOTH = CLOTH * np.array([
    _CLOTHED.get(cone.body.removeprefix("Left").removeprefix("Right"), 1.0) for cone in CONES
])  # fmt: skip
_KEYS = tuple(_scales(np.zeros(len(SHAPE))))
_GIRTH_KEY = np.array([_KEYS.index(cone.girth) for cone in CONES])
_AXIS_KEYS = np.array([[_KEYS.index(key) for key in _axis_keys(cone)] for cone in CONES])


def surface_of(shape: Array) -> Surface:
    """Return the surface of a shape."""
    scale = np.array(list(_scales(shape).values())) * USUAL_HEIGHT_M
    axis = _AXES * scale[_AXIS_KEYS]
    length = np.linalg.norm(axis, axis=1)
    z = axis / length[:, None]
    x = _ACROSS - (_ACROSS * z).sum(axis=1, keepdims=True) * z
    along = np.linalg.norm(x, axis=1) < 1e-6  # an axis along `across`: any perpendicular direction is allowed
    x[along] = np.array([0.0, 1.0, 0.0]) - z[along, 1:2] * z[along]
    x /= np.linalg.norm(x, axis=1, keepdims=True)
    frame = np.stack([x, np.cross(z, x), z], axis=2)
    radii = _RADII * scale[_GIRTH_KEY][:, None] + (_CLOTH * scale[_KEYS.index("cloth")])[:, None]
    return Surface(
        _BODIES,
        _CONE_PARTS,
        np.arange(CONE_COUNT),
        _STARTS * scale[_AXIS_KEYS],
        frame,
        length,
        radii[:, 0].copy(),
        radii[:, 1].copy(),
        _FLAT,
    )


def humanoid_of(shape: Array) -> Humanoid:
    """Return the humanoid of a shape, for its hinges and limits."""
    return build_humanoid(Skeleton.of(performer_of(shape)))


def _canonical_bodies() -> NDArray[np.int64]:
    bodies = []
    for name in CANONICAL:
        output = OUTPUT_OF_CANONICAL[name]
        bodies.append(BODY_JOINTS.index(output.removesuffix("Middle1") if "Middle1" in output else output))
    return np.array(bodies)


CANONICAL_BODIES: NDArray[np.int64] = _canonical_bodies()
"""Body that carries each canonical joint, shape (21,)."""


def canonical_offsets_of(shape: Array) -> Array:
    """Return the offset of each canonical joint from its body's joint in the T-pose [m], shape (21, 3)."""
    skeleton = Skeleton.of(performer_of(shape))
    offsets = np.zeros((len(CANONICAL), 3))
    for side in ("left", "right"):
        offsets[INDEX[f"{side}_hand"]] = skeleton.offsets_m[OUTPUT_INDEX[OUTPUT_OF_CANONICAL[f"{side}_hand"]]]
    return offsets
