"""Anatomical ranges of motion, one entry per degree of freedom of the human model.

Angles are measured from the T-pose. Ends are those of the American Academy of Orthopaedic Surgeons
("Joint Motion: Method of Measuring and Recording", 1965; tabulated in Norkin & White, "Measurement of
Joint Motion", 5th ed. 2016, appendix B), turned to the model's axes; spans of several vertebrae are shared
among the model's joints, and a span that the clavicle adds to the shoulder (the scapulohumeral rhythm,
Inman 1944) is on the clavicle.

Axes are those of the left side and of the middle; the right side mirrors them in the plane x = 0. Stage axes
in the T-pose: x to the performer's left, y to the back, z up.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

SHOULDER_AXIS_DEG = 40.0
"""The shoulder's first axis points this far behind the outstretched arm. An arm along its first axis loses a
degree of freedom; at this angle that happens only behind the back's plane or through the opposite shoulder."""

_C, _S = math.cos(math.radians(SHOULDER_AXIS_DEG)), math.sin(math.radians(SHOULDER_AXIS_DEG))
X, Y, Z = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)


@dataclass(frozen=True)
class Dof:
    """One hinge: its axis in the T-pose, its range [deg], its place in the resting stance [deg], and how far
    it usually strays from it, as a standard deviation [deg]."""

    name: str
    axis: tuple[float, float, float]
    low_deg: float
    high_deg: float
    rest_deg: float = 0.0
    spread_deg: float = 20.0


_SPINE = (
    Dof("bend", X, -12, 28, spread_deg=8),
    Dof("side", Y, -12, 12, spread_deg=6),
    Dof("twist", Z, -15, 15, spread_deg=6),
)

DOFS: dict[str, tuple[Dof, ...]] = {
    "Spine": _SPINE,
    "Spine1": _SPINE,
    "Spine2": _SPINE,
    "Neck": (
        Dof("bend", X, -28, 25, spread_deg=12),
        Dof("side", Y, -22, 22, spread_deg=8),
        Dof("twist", Z, -40, 40, spread_deg=15),
    ),
    "Head": (
        Dof("bend", X, -28, 25, spread_deg=10),
        Dof("side", Y, -22, 22, spread_deg=8),
        Dof("twist", Z, -40, 40, spread_deg=15),
    ),
    "LeftShoulder": (
        Dof("lift", Y, -40, 12, spread_deg=10),
        Dof("forward", Z, -25, 25, spread_deg=8),
    ),
    "LeftArm": (
        Dof("swing", (_C, _S, 0.0), -120, 150, rest_deg=88, spread_deg=50),
        Dof("raise", Z, -130, 30, rest_deg=-55, spread_deg=35),
        Dof("twist", X, -100, 100, rest_deg=-30, spread_deg=35),
    ),
    "LeftForeArm": (
        Dof("bend", Z, -150, 3, rest_deg=-15, spread_deg=50),
        Dof("twist", X, -150, 30, rest_deg=-25, spread_deg=40),
    ),
    "LeftHand": (
        Dof("bend", Y, -70, 80, spread_deg=20),
        Dof("side", Z, -20, 30, spread_deg=12),
    ),
    "LeftUpLeg": (
        Dof("bend", X, -125, 30, rest_deg=-5, spread_deg=35),
        Dof("side", Y, -50, 30, rest_deg=-3, spread_deg=15),
        Dof("twist", Z, -45, 45, spread_deg=15),
    ),
    "LeftLeg": (Dof("bend", X, -3, 150, rest_deg=8, spread_deg=40),),
    "LeftFoot": (
        Dof("bend", X, -25, 50, spread_deg=15),
        Dof("side", Y, -20, 35, spread_deg=10),
    ),
    "LeftToeBase": (Dof("bend", X, -60, 40, spread_deg=12),),
}
"""Hinges of each output joint, in order from the parent outward; `Hips` is free. Positive turns follow the
right hand about the axis: a positive bend about x tips what stands (the spine) forward and swings what hangs
(a leg) backward."""


def mirrored(dof: Dof) -> Dof:
    """Return the right side's hinge: mirrored in x = 0, an axis keeps its x and turns y and z about."""
    x, y, z = dof.axis
    return Dof(dof.name, (x, -y, -z), dof.low_deg, dof.high_deg, dof.rest_deg, dof.spread_deg)


def dofs_of(joint: str) -> tuple[Dof, ...]:
    """Return the hinges of an output joint, left, right or middle; none for a joint without (fingers)."""
    if joint.startswith("Right"):
        return tuple(mirrored(dof) for dof in DOFS.get("Left" + joint.removeprefix("Right"), ()))
    return DOFS.get(joint, ())


def range_rad(dof: Dof, flexibility: float) -> NDArray[np.float64]:
    """Return a hinge's (low, high) [rad] for a flexibility of 0 (an old performer) to 2 (a gymnast).

    Ends scale from 0.75 over 1 to 1.3 times; an end within 5 degrees of the T-pose (a straight knee) stays.
    """
    scale = float(np.interp(flexibility, [0.0, 1.0, 2.0], [0.75, 1.0, 1.3]))
    ends = np.array([dof.low_deg, dof.high_deg])
    return np.radians(np.where(np.abs(ends) > 5.0, ends * scale, ends))
