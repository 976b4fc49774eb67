"""Feet: a shoe's upper on a sole of the seams' tone, both bending at the ball of the foot."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from studio.engine.animation.mannequin.loft import Sections, capped_places, course, dome, loft, smoothstep
from studio.engine.animation.mannequin.mesh import BODY, SEAM, MannequinPart
from studio.engine.animation.mannequin.rig import MannequinRig

Array = NDArray[np.float64]

_USUAL_FOOT_M = 0.145
"""Distance from ankle to ball of the foot, along the floor, for which the tables are in metres."""

_HEEL, _TOES = 0.062, 0.076
_SECTORS = {BODY: 16, SEAM: 8}
# Place (0 = ankle, 1 = ball of the foot), half-width, height of the upper side over the floor, how far the middle
# lies towards the other foot [m]: the inner edge is straight, the outer one runs back from the toes.
_TABLE = (
    (-0.43, 0.029, 0.066, 0.0), (-0.2, 0.033, 0.088, 0.0), (0.0, 0.0345, 0.098, 0.0),
    (0.25, 0.0345, 0.088, 0.001), (0.5, 0.0385, 0.069, 0.001), (0.8, 0.0445, 0.051, 0.001),
    (1.0, 0.0460, 0.045, 0.002),
    (1.25, 0.0425, 0.040, 0.006), (1.52, 0.034, 0.033, 0.012),
)  # fmt: skip
_SOLE_M, _WELT_M = 0.015, 0.0025
"""Thickness of the sole, and how far it stands out beyond the upper."""


def foot(rig: MannequinRig, side: str) -> list[MannequinPart]:
    """Return the upper and the sole of one foot."""
    ankle, size, forward, toe = foot_frame(rig, side)
    shape = _Outline.of(rig, side, ankle, size, forward)
    thin = _SOLE_M * size
    parts = []
    for tone in (BODY, SEAM):
        low, top = (0.6 * thin, shape.top) if tone == BODY else (0.0, np.full(len(shape.at), thin))
        wide = shape.wide if tone == BODY else shape.wide + _WELT_M * size
        middle = low + (0.40 if tone == BODY else 0.5) * (top - low)
        groove = shape.groove if tone == BODY else 0.0
        sections = shape.sections(
            middle, wide - groove, top - middle - groove, middle - low, 2.4 if tone == BODY else 4.0
        )
        points, triangles, section = loft(sections, _SECTORS[tone])
        points[:, 1] = np.maximum(points[:, 1], rig.floor)
        bent = smoothstep(shape.at, shape.reach, 0.016 * size)[section] if toe else np.zeros(len(points))
        shares = {f"{side}Foot": 1.0 - bent}
        if toe:
            shares[f"{side}ToeBase"] = bent
        parts.append(MannequinPart(points, triangles, rig.weights(shares, len(points)), tone))
    return parts


@dataclass(frozen=True)
class _Outline:
    """A foot seen from above and from the side, at places along it [m].

    Attributes:
        at: from the ankle, shape (N,); reach: of the ball of the foot.
        line: the middle on the floor, shape (N, 3); across: unit, to the performer's left.
        wide: half-width; top: height of the upper side; round_off: factor at heel and toes; groove: at the ball.
    """

    at: Array
    reach: float
    line: Array
    across: Array
    wide: Array
    top: Array
    round_off: Array
    groove: Array

    @classmethod
    def of(cls, rig: MannequinRig, side: str, ankle: Array, size: float, forward: Array) -> "_Outline":
        reach = _USUAL_FOOT_M * size
        start, stop = -_HEEL * size, reach + _TOES * size
        caps = (0.035 * size, 0.045 * size)
        ball = reach + 0.010 * size * np.array([-1.5, -0.5, 0.0, 0.5, 1.5])
        at = np.unique(np.concatenate([capped_places(start, stop, *caps, 8), ball]))
        wide, top, inward = (
            course([(row[0], row[k]) for row in _TABLE], at / reach) * size for k in (1, 2, 3)
        )
        across = np.cross([0.0, 1.0, 0.0], forward)
        line = np.array([ankle[0], rig.floor, ankle[2]]) + np.outer(at, forward)
        return cls(
            at, reach, line + np.outer(inward, -across if side == "Left" else across), across, wide * rig.build.foot,
            top * min(1.0, (ankle[1] - rig.floor + 0.02 * size) / (0.098 * size)), dome(at, start, stop, *caps),
            0.0025 * size * np.exp(-(((at - reach) / (0.004 * size)) ** 2)),
        )  # fmt: skip

    def sections(self, middle: Array, wide: Array, above: Array, below: Array, power: float) -> Sections:
        """Return sections whose middles lie at heights over the floor."""
        ones, up = np.ones(len(self.at)), np.array([0.0, 1.0, 0.0])
        return Sections(
            self.line + np.outer(middle, up), np.outer(ones, self.across), np.outer(ones, up),
            wide * self.round_off, above * self.round_off, below * self.round_off, power * ones,
        )  # fmt: skip


def foot_frame(rig: MannequinRig, side: str) -> tuple[Array, float, Array, bool]:
    """Return the ankle, the size of the foot, its direction on the floor, and whether it has toes."""
    ankle = rig.at(f"{side}Foot")
    forward = np.array([0.0, 0.0, 1.0])
    if rig.has(f"{side}ToeBase"):
        way = (rig.at(f"{side}ToeBase") - ankle) * [1.0, 0.0, 1.0]
        length = float(np.linalg.norm(way))
        if length > 0.02 * rig.stature:
            return ankle, length / _USUAL_FOOT_M, way / length, True
    return ankle, 0.083 * rig.stature / _USUAL_FOOT_M, forward, False
