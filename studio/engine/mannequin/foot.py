"""Feet: one loft from the heel to the toes on a flat sole, bending at the ball of the foot."""

import numpy as np
from numpy.typing import NDArray

from studio.engine.mannequin.loft import Sections, capped_places, course, dome, loft, smoothstep
from studio.engine.mannequin.mesh import BODY, Part
from studio.engine.mannequin.rig import Rig

Array = NDArray[np.float64]

_USUAL_FOOT_M = 0.145
"""Ankle to ball of the foot, along the floor, at which the tables are metres."""

_HEEL, _TOES = 0.062, 0.070
# Place (0 = ankle, 1 = ball of the foot), half-width, height of the upper side over the sole [m].
_TABLE = (
    (-0.43, 0.030, 0.060), (-0.2, 0.033, 0.085), (0.0, 0.0345, 0.098), (0.25, 0.0355, 0.086),
    (0.5, 0.039, 0.066), (0.8, 0.045, 0.046), (1.0, 0.0465, 0.038), (1.25, 0.044, 0.031), (1.5, 0.034, 0.024),
)  # fmt: skip


def foot(rig: Rig, side: str) -> Part:
    """Return one foot."""
    ankle, size, forward, toe = _frame(rig, side)
    reach = _USUAL_FOOT_M * size
    start, stop = -_HEEL * size, reach + _TOES * size
    caps = (0.035 * size, 0.045 * size)
    at = capped_places(start, stop, *caps, 8)
    ball = reach + 0.010 * size * np.array([-1.5, -0.5, 0.0, 0.5, 1.5])
    at = np.unique(np.concatenate([at, ball]))
    share = at / reach
    round_off = dome(at, start, stop, *caps)
    wide = course([(row[0], row[1]) for row in _TABLE], share) * size
    top = course([(row[0], row[2]) for row in _TABLE], share) * size
    top *= min(1.0, (ankle[1] - rig.floor + 0.02 * size) / (0.098 * size))
    groove = 0.0025 * size * np.exp(-(((at - reach) / (0.004 * size)) ** 2))
    middle = 0.42 * top
    wide, above, below = ((length - groove) * round_off for length in (wide, top - middle, middle))
    ones = np.ones(len(at))
    up = np.array([0.0, 1.0, 0.0])
    across = np.cross(up, forward)
    centres = np.array([ankle[0], rig.floor, ankle[2]]) + np.outer(at, forward) + np.outer(middle, up)
    sections = Sections(centres, np.outer(ones, across), np.outer(ones, up), wide, above, below, 2.5 * ones)
    points, triangles, section = loft(sections, 16)
    points[:, 1] = np.maximum(points[:, 1], rig.floor)
    bent = smoothstep(at, reach, 0.016 * size)[section] if toe else np.zeros(len(points))
    shares = {f"{side}Foot": 1.0 - bent}
    if toe:
        shares[f"{side}ToeBase"] = bent
    return Part(points, triangles, rig.weights(shares, len(points)), BODY)


def _frame(rig: Rig, side: str) -> tuple[Array, float, Array, bool]:
    """Return the ankle, the size of the foot, where it points on the floor, and whether it has toes."""
    ankle = rig.at(f"{side}Foot")
    forward = np.array([0.0, 0.0, 1.0])
    if rig.has(f"{side}ToeBase"):
        way = (rig.at(f"{side}ToeBase") - ankle) * [1.0, 0.0, 1.0]
        length = float(np.linalg.norm(way))
        if length > 0.02 * rig.stature:
            return ankle, length / _USUAL_FOOT_M, way / length, True
    return ankle, 0.083 * rig.stature / _USUAL_FOOT_M, forward, False
