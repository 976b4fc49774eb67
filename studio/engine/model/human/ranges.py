"""Anatomical ranges of motion, one entry per degree of freedom of the human model.

Angles are measured from the T-pose and turned to the model's axes. Sources, named next to the numbers:
AAOS: American Academy of Orthopaedic Surgeons, "Joint Motion: Method of Measuring and Recording", 1965;
AMA: American Medical Association, "Guides to the Evaluation of Permanent Impairment", 5th ed. 2000; both as
tabulated in Norkin & White, "Measurement of Joint Motion", 5th ed. 2016, appendix B. The model's joints share the
span of several vertebrae. The clavicle has the part of the shoulder's span that it adds (scapulohumeral rhythm, Inman
1944).

Axes are for the left side and the middle; the right side is mirrored in the plane x = 0. Stage axes in the T-pose: x
to the performer's left, y to the back, z up.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from studio.engine.model.joints import FINGERS

SHOULDER_AXIS_DEG = 40.0
"""The shoulder's first axis points this far behind the outstretched arm. An arm along its first axis loses a
degree of freedom; at this angle that needs an arm behind the back's plane or through the opposite shoulder.
"""

_C, _S = math.cos(math.radians(SHOULDER_AXIS_DEG)), math.sin(math.radians(SHOULDER_AXIS_DEG))
X, Y, Z = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)

MAX_DEG = 175.0
"""Largest end of a range at any flexibility."""

_THUMB_SIDE = (math.sin(math.radians(43.0)), math.cos(math.radians(43.0)), 0.0)
THUMB_AXIS = (0.672, 0.484, math.sqrt(1.0 - 0.672**2 - 0.484**2))
"""Bending axis of the thumb's last two joints: across the stretched thumb, towards the palm and the fingers."""


@dataclass(frozen=True)
class Dof:
    """One hinge: its axis in the T-pose, its range [deg], its angle in the resting stance [deg], and the usual
    standard deviation from it [deg].
    """

    name: str
    axis: tuple[float, float, float]
    low_deg: float
    high_deg: float
    rest_deg: float = 0.0
    spread_deg: float = 20.0


# AAOS, thoracolumbar: flexion 80, extension 30, lateral flexion 35, rotation 45; a third for each of three joints.
# Bending has 150 in all, the sum of its vertebrae (White & Panjabi, "Clinical Biomechanics of the Spine", 1990). The
# T-pose lies at another place between the ends for each performer, so each end has half of the 40 more.
_SPINE = (
    Dof("bend", X, -17, 33, spread_deg=8),
    Dof("side", Y, -12, 12, spread_deg=6),
    Dof("twist", Z, -15, 15, spread_deg=6),
)

# AMA, cervical: flexion 50, extension 60, lateral flexion 45, rotation 80 (AAOS: 45, 45, 45, 60); a half for each.
_NECK = (
    Dof("bend", X, -30, 25, spread_deg=12),
    Dof("side", Y, -22, 22, spread_deg=8),
    Dof("twist", Z, -40, 40, spread_deg=15),
)

# AAOS, fingers: MCP flexion 90, extension 45, abduction 20; PIP flexion 100; DIP flexion 90. The fingers lie
# outward in the T-pose, palm down: a positive bend closes them.
_FINGER: dict[int, tuple[Dof, ...]] = {
    1: (Dof("bend", Y, -45, 90, rest_deg=20, spread_deg=25), Dof("side", Z, -20, 20, spread_deg=6)),
    2: (Dof("bend", Y, 0, 100, rest_deg=25, spread_deg=30),),
    3: (Dof("bend", Y, 0, 90, rest_deg=16, spread_deg=20),),
}

# AAOS, thumb: CMC abduction 70, of which the T-pose has 15, flexion 15, extension 20; MCP flexion 50; IP
# flexion 80, extension 20. Abduction leads away from the palm's plane, flexion across the palm.
_THUMB: dict[int, tuple[Dof, ...]] = {
    1: (
        Dof("side", _THUMB_SIDE, -15, 55, rest_deg=10, spread_deg=12),
        Dof("bend", Z, -20, 15, spread_deg=8),
    ),
    2: (Dof("bend", THUMB_AXIS, 0, 50, rest_deg=10, spread_deg=15),),
    3: (Dof("bend", THUMB_AXIS, -20, 80, rest_deg=15, spread_deg=20),),
}

DOFS: dict[str, tuple[Dof, ...]] = {
    "Spine": _SPINE,
    "Spine1": _SPINE,
    "Spine2": _SPINE,
    "Neck": _NECK,
    "Head": _NECK,
    # Inman 1944: the clavicle rises 40 and sinks 12; Levangie & Norkin 2011: forward 15 to 20, backward 20 to 30.
    "LeftShoulder": (
        Dof("lift", Y, -40, 12, spread_deg=10),
        Dof("forward", Z, -25, 25, spread_deg=8),
    ),
    # AAOS: flexion 180, extension 60, abduction 180, rotation inward 70 and outward 90, less the clavicle's share.
    "LeftArm": (
        Dof("swing", (_C, _S, 0.0), -120, 150, rest_deg=88, spread_deg=50),
        Dof("raise", Z, -130, 30, rest_deg=-55, spread_deg=35),
        Dof("twist", X, -100, 100, rest_deg=-30, spread_deg=35),
    ),
    # AAOS: flexion 150, extension 0, pronation and supination 80. Palms down in the T-pose, the forearm is
    # neither pronated nor supinated: the thumb points where the elbow bends to.
    "LeftForeArm": (
        Dof("bend", Z, -150, 3, rest_deg=-15, spread_deg=50),
        Dof("twist", X, -80, 80, rest_deg=-10, spread_deg=40),
    ),
    # AAOS: flexion 80, extension 70, to the thumb's side 20, to the little finger's 30.
    "LeftHand": (
        Dof("bend", Y, -70, 80, spread_deg=20),
        Dof("side", Z, -20, 30, spread_deg=12),
    ),
    **{f"LeftHandThumb{k}": dofs for k, dofs in _THUMB.items()},
    **{f"LeftHand{finger}{k}": dofs for finger in FINGERS[1:] for k, dofs in _FINGER.items()},
    # AAOS: flexion 120, extension 30, abduction 45, adduction 30, rotation 45 inward and outward. Men from 18
    # months to 54 years reach 122 and 46 with deviations of 6 and 9 (Boone & Azen, JBJS 1979): half of one more.
    # Weight or swing press a bent knee's thigh further than its own muscles: passively 141 in girls and 131 in boys
    # up to 8 years, less with age (Soucie et al., Haemophilia 17, 2011, p. 500), here 140. This is measured from
    # outside and includes some tilt of the pelvis: in tomography the bones alone pass 120 with abduction only
    # ("Normal adult hip range of motion", J. Korean Orthop. Assoc. 41, 2006, p. 361).
    "LeftUpLeg": (
        Dof("bend", X, -140, 30, rest_deg=-5, spread_deg=35),
        Dof("side", Y, -50, 30, rest_deg=-3, spread_deg=15),
        Dof("twist", Z, -45, 45, spread_deg=15),
    ),
    # AMA: flexion 150 (AAOS: 135, by its own muscles); AAOS: extension up to 10, here 3.
    "LeftLeg": (Dof("bend", X, -3, 150, rest_deg=8, spread_deg=40),),
    # AAOS: toes down 50, inversion 35; AMA: eversion 20. Toes up AAOS 20; a standing foot under load reaches 38
    # (Bennell et al. 1998). Rotation: the shank turns under a bent knee, inward 30 and outward 40
    # (Kapandji, "The physiology of the joints", vol. 2, 1987), and carries the foot. The model has no hinge of the
    # knee for this, nor for a twisted shin. Standing feet point outward by 7 (McIlroy & Maki 1997).
    "LeftFoot": (
        Dof("bend", X, -38, 50, spread_deg=15),
        Dof("side", Y, -20, 35, spread_deg=10),
        Dof("turn", Z, -30, 40, rest_deg=7, spread_deg=13),
    ),
    # AAOS: extension 70 (great toe) and 40 (others), flexion 45 and 40.
    "LeftToeBase": (Dof("bend", X, -60, 40, spread_deg=12),),
}
"""Hinges of each output joint, in order from the parent outward; `Hips` is free. Positive turns follow the
right-hand rule: a positive bend about x tips the spine forward and swings a leg backward.
"""


def mirrored(dof: Dof) -> Dof:
    """Return the right side's hinge, mirrored in x = 0: the axis keeps its x and negates y and z."""
    x, y, z = dof.axis
    return Dof(dof.name, (x, -y, -z), dof.low_deg, dof.high_deg, dof.rest_deg, dof.spread_deg)


def dofs_of(joint: str) -> tuple[Dof, ...]:
    """Return the hinges of an output joint, left, right or middle; none for the free hips."""
    if joint.startswith("Right"):
        return tuple(mirrored(dof) for dof in DOFS.get("Left" + joint.removeprefix("Right"), ()))
    return DOFS.get(joint, ())


def range_rad(dof: Dof, flexibility: float) -> NDArray[np.float64]:
    """Return a hinge's (low, high) [rad] for a flexibility of 0 (an old performer) to 2 (a gymnast).

    Ends scale from 0.75 over 1 to 1.3 times. An end within 5 degrees of the T-pose (a straight knee) stays. No end
    reaches half a turn, where two angles would mean one pose. Source: people over 70 lose a fifth to a
    quarter of most ranges (Doriot & Wang, "Effects of age and gender on maximum voluntary range of motion of
    the upper body joints", Ergonomics 2006); gymnasts exceed the usual hip and trunk ranges by a third and more.
    """
    scale = float(np.interp(flexibility, [0.0, 1.0, 2.0], [0.75, 1.0, 1.3]))
    ends = np.array([dof.low_deg, dof.high_deg])
    return np.radians(np.clip(np.where(np.abs(ends) > 5.0, ends * scale, ends), -MAX_DEG, MAX_DEG))
