"""Mass, centre of mass and inertia of every body of the humanoid, from stature and bones.

Source: de Leva, "Adjustments to Zatsiorsky-Seluyanov's segment inertia parameters", J. Biomechanics 1996,
table 4; means of women and men. Limbs have the length of the performer's bones. Trunk, head and foot have the length
of the source's subjects, scaled by stature, because a device's trunk joints are not the source's landmarks. Where the
model divides a segment of the source, the comments next to the numbers give the shares.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from studio.engine.model.human.skeleton import Skeleton
from studio.engine.model.joints import FINGERS, OUTPUT_INDEX

Triple = tuple[float, float, float]

# Body mass index by stature. Adults: the middle of the usual 18.5 to 25 (WHO 2000); children: medians of
# the WHO growth standards (2006, 2007) at the age of that height.
_BMI_HEIGHT_M = (0.9, 1.1, 1.3, 1.5, 1.65)
_BMI = (16.0, 15.3, 16.2, 18.5, 21.7)


def body_mass_kg(height_m: float) -> float:
    """Return the usual mass of a performer of this stature [kg]."""
    return float(np.interp(height_m, _BMI_HEIGHT_M, _BMI)) * height_m**2


@dataclass(frozen=True)
class BodyInertia:
    """One body in the T-pose: mass [kg], centre of mass from its joint [m], shape (3,), and moments of inertia
    about it along the stage's axes [kg m2], shape (3,).
    """

    mass_kg: float
    centre_m: NDArray[np.float64]
    inertia_kg_m2: NDArray[np.float64]


# Limbs: the bone's end, share of the body's mass, centre as a share of the bone, radii of gyration about x, y, z
# as shares of the bone's length.
_LIMBS: dict[str, tuple[str, float, float, Triple]] = {
    "Arm": ("ForeArm", 0.0263, 0.576, (0.153, 0.282, 0.265)),
    "ForeArm": ("Hand", 0.0150, 0.457, (0.108, 0.261, 0.269)),
    "Hand": ("HandMiddle1", 0.0058, 0.769, (0.368, 0.484, 0.580)),
    "UpLeg": ("Leg", 0.1447, 0.385, (0.347, 0.349, 0.156)),
    "Leg": ("Foot", 0.0457, 0.437, (0.254, 0.259, 0.097)),
}

# Trunk and head: share of the body's mass, radii of gyration about x, y, z as shares of stature.
_UPPER_TRUNK: tuple[float, Triple] = (0.1570, (0.0429, 0.0656, 0.0618))
_MIDDLE_TRUNK: tuple[float, Triple] = (0.1549, (0.0446, 0.0554, 0.0534))
_LOWER_TRUNK: tuple[float, Triple] = (0.1182, (0.0449, 0.0493, 0.0485))
_HEAD_AND_NECK: tuple[float, Triple] = (0.0681, (0.0427, 0.0402, 0.0367))
_FOOT: tuple[float, Triple] = (0.0133, (0.0367, 0.0184, 0.0389))

_MIDDLE_TRUNK_LENGTH = 0.121  # of stature; two joints share it, a half each
_HEAD_CENTRE_ABOVE_NECK = 0.079  # of stature: the head without its neck, over the seventh cervical vertebra
_NECK_SHARE = 0.2  # of head and neck: 1 kg in an adult, as its volume between chin and shoulders
_CLAVICLE_SHARE = 0.08  # of the upper trunk, each side: the part that moves with the shoulder blade
_TOE_SHARE = 0.15  # of the foot: the part in front of the ball
_FOOT_CENTRE = 0.4  # of the way from the ankle to the ball
_PALM_CENTRE = 0.5  # of the way from the wrist to the knuckle
_PALM_RADII: Triple = (0.29, 0.30, 0.40)  # a slab as broad as long, a third as thick

# Radii of round segments, as shares of stature; the fingers' half breadths from Garrett, "The adult human hand",
# 1971.
_NECK_RADIUS, _CLAVICLE_RADIUS, _TOE_RADIUS, _TOE_LENGTH = 0.034, 0.030, 0.012, 0.035
_FINGER_RADII: Triple = (0.0052, 0.0049, 0.0044)
_DENSITY_KG_M3 = 1100.0  # of a hand: Clauser et al. 1969


def _body(mass: float, centre: NDArray[np.float64], radii: NDArray[np.float64] | Triple) -> BodyInertia:
    return BodyInertia(mass, centre, mass * np.square(radii))


def _cylinder(mass: float, bone: NDArray[np.float64], radius: float) -> BodyInertia:
    """A solid cylinder along a bone."""
    length = float(np.linalg.norm(bone))
    along = np.square(bone / length)
    across = (3.0 * radius**2 + length**2) / 12.0
    return BodyInertia(mass, 0.5 * bone, mass * (along * radius**2 / 2.0 + (1.0 - along) * across))


def body_inertias(skeleton: Skeleton, *, fingers: bool) -> dict[str, BodyInertia]:
    """Return every body's inertia by output joint; hands include the fingers where these are no bodies."""
    return _trunk(skeleton) | _limbs(skeleton) | (_hands(skeleton) if fingers else {})


def _trunk(skeleton: Skeleton) -> dict[str, BodyInertia]:
    offset = {name: skeleton.offsets_m[i] for name, i in OUTPUT_INDEX.items()}
    height, total = skeleton.height_m, body_mass_kg(skeleton.height_m)
    half = 0.25 * _MIDDLE_TRUNK_LENGTH  # half the length of one half, for the parallel axis theorem
    middle_radii = np.sqrt(np.square(_MIDDLE_TRUNK[1]) - np.square([half, half, 0.0]))
    head_up = np.array([0.0, 0.0, max(_HEAD_CENTRE_ABOVE_NECK * height - offset["Head"][2], 0.0)])
    clavicle = total * _UPPER_TRUNK[0] * _CLAVICLE_SHARE
    neck = total * _HEAD_AND_NECK[0] * _NECK_SHARE

    def part(share: float, segment: tuple[float, Triple], centre: NDArray[np.float64]) -> BodyInertia:
        return _body(total * share * segment[0], centre, height * np.array(segment[1]))

    middle = (_MIDDLE_TRUNK[0], tuple(middle_radii))
    return {
        "Hips": part(1.0, _LOWER_TRUNK, 0.45 * (offset["Spine"] + offset["Spine1"])),
        "Spine": part(0.5, middle, offset["Spine1"] + 0.25 * offset["Spine2"]),
        "Spine1": part(0.5, middle, 0.75 * offset["Spine2"]),
        "Spine2": part(1.0 - 2.0 * _CLAVICLE_SHARE, _UPPER_TRUNK, 0.49 * offset["Neck"]),
        "Neck": _cylinder(neck, offset["Head"], _NECK_RADIUS * height),
        "Head": part(1.0 - _NECK_SHARE, _HEAD_AND_NECK, head_up),
        **{
            f"{side}Shoulder": _cylinder(clavicle, offset[f"{side}Arm"], _CLAVICLE_RADIUS * height)
            for side in ("Left", "Right")
        },
    }


def _limbs(skeleton: Skeleton) -> dict[str, BodyInertia]:
    height, total = skeleton.height_m, body_mass_kg(skeleton.height_m)
    bodies: dict[str, BodyInertia] = {}
    for side in ("Left", "Right"):
        for name, (end, mass, centre, radii) in _LIMBS.items():
            bone = skeleton.offsets_m[OUTPUT_INDEX[side + end]]
            length = float(np.linalg.norm(bone))
            bodies[side + name] = _body(total * mass, centre * bone, length * np.array(radii))
        foot = total * _FOOT[0]
        ball = skeleton.offsets_m[OUTPUT_INDEX[f"{side}ToeBase"]]
        bodies[f"{side}Foot"] = _body(
            (1.0 - _TOE_SHARE) * foot, _FOOT_CENTRE * ball, height * np.array(_FOOT[1])
        )
        toes = np.array([0.0, -_TOE_LENGTH * height, 0.0])
        bodies[f"{side}ToeBase"] = _cylinder(_TOE_SHARE * foot, toes, _TOE_RADIUS * height)
    return bodies


def _hands(skeleton: Skeleton) -> dict[str, BodyInertia]:
    """Palms and finger bones: the fingers' mass from their volume, the palm's the rest of the hand's."""
    height, total = skeleton.height_m, body_mass_kg(skeleton.height_m)
    bodies: dict[str, BodyInertia] = {}
    for side in ("Left", "Right"):
        palm = total * _LIMBS["Hand"][1]
        for finger in FINGERS:
            names = [f"{side}Hand{finger}{k}" for k in (1, 2, 3)]
            bones = [skeleton.offsets_m[OUTPUT_INDEX[name]] for name in names[1:]]
            for name, bone, radius in zip(
                names, [*bones, skeleton.finger_tip_m(names[2])], _FINGER_RADII, strict=True
            ):
                volume = np.pi * (radius * height) ** 2 * float(np.linalg.norm(bone))
                bodies[name] = _cylinder(_DENSITY_KG_M3 * volume, bone, radius * height)
                palm -= bodies[name].mass_kg
        knuckle = skeleton.offsets_m[OUTPUT_INDEX[f"{side}HandMiddle1"]]
        length = float(np.linalg.norm(knuckle))
        bodies[f"{side}Hand"] = _body(palm, _PALM_CENTRE * knuckle, length * np.array(_PALM_RADII))
    return bodies
