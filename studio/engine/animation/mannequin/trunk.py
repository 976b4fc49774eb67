"""Trunk and shoulders: one loft from the crotch to the neck, and a yoke to each shoulder."""

import numpy as np
from numpy.typing import NDArray

from studio.engine.animation.mannequin.loft import Sections, capped_places, course, dome, loft, smoothstep
from studio.engine.animation.mannequin.mesh import BODY, MannequinPart
from studio.engine.animation.mannequin.rig import MannequinRig

Array = NDArray[np.float64]

_SECTORS = 24
# Half-widths of pelvis and chest minus the half distances of hip and shoulder joints [m at a stature of 1.75 m]. In
# the table, heights are 0 at the hip and 1 at the shoulder joints, depths in the same unit; power is squareness.
_PELVIS_BEYOND, _CHEST_BEYOND = 0.076, -0.022
_TABLE = (
    # height, share of the pelvis' width, share of the chest's, fore, aft, power
    (-0.24, 0.50, 0.0, 0.060, 0.070, 2.2),
    (-0.14, 0.86, 0.0, 0.078, 0.098, 2.3),
    (-0.04, 1.00, 0.0, 0.088, 0.110, 2.4),
    (0.08, 1.00, 0.0, 0.094, 0.106, 2.4),
    (0.20, 0.90, 0.05, 0.092, 0.088, 2.4),
    (0.34, 0.44, 0.42, 0.088, 0.078, 2.4),
    (0.44, 0.24, 0.60, 0.090, 0.080, 2.4),
    (0.58, 0.08, 0.86, 0.104, 0.092, 2.5),
    (0.74, 0.0, 1.02, 0.116, 0.102, 2.5),
    (0.88, 0.0, 1.02, 0.108, 0.102, 2.4),
    (1.00, 0.0, 0.90, 0.084, 0.094, 2.3),
    (1.08, 0.0, 0.66, 0.066, 0.080, 2.2),
    (1.16, 0.0, 0.42, 0.056, 0.064, 2.1),
    (1.26, 0.0, 0.36, 0.050, 0.056, 2.0),
)
_SPINE = ("Hips", "Spine", "Spine1", "Spine2")
_SEAMS = (0.30, 0.5)
_GROOVE_WIDE, _GROOVE_DEEP = 0.010, 0.004


def trunk(rig: MannequinRig) -> list[MannequinPart]:
    """Return the torso and both yokes."""
    return [_torso(rig), *(_yoke(rig, side) for side in ("Left", "Right"))]


def _torso(rig: MannequinRig) -> MannequinPart:
    low, high, g = rig.hip_centre, rig.shoulder_centre, rig.girth
    rise = high[1] - low[1]
    start, stop = _TABLE[0][0] * rise, _TABLE[-1][0] * rise
    caps = (0.05 * g, 0.03 * g)
    at = capped_places(start, stop, *caps, 16)
    seams = np.concatenate(
        [rise * seam + _GROOVE_WIDE * g * np.array([-1, -0.4, 0, 0.4, 1]) for seam in _SEAMS]
    )
    at = np.unique(np.concatenate([at, seams]))
    share = at / rise

    def column(k: int) -> Array:
        return course([(row[0], row[k]) for row in _TABLE], share)

    pelvis = _half_distance(rig, "UpLeg") + _PELVIS_BEYOND * g
    chest = _half_distance(rig, "Arm") + _CHEST_BEYOND * g
    groove = sum(
        _GROOVE_DEEP * g * np.exp(-(((at - rise * seam) / (0.5 * _GROOVE_WIDE * g)) ** 2)) for seam in _SEAMS
    )
    round_off = dome(at, start, stop, *caps)
    wide = (column(1) * pelvis + column(2) * chest - groove) * round_off * rig.build.of_trunk(share, 1)
    fore, aft = ((column(k) * g - groove) * round_off * rig.build.of_trunk(share, k - 1) for k in (3, 4))
    way = rig.at("Head") - high
    lean = float(np.clip(way[2] / max(way[1], 0.1 * g), -1.0, 1.0))  # of the neck's base, towards the head
    depth = np.clip(share, 0.0, 1.0) * (high[2] - low[2]) + lean * np.clip(at - rise, 0.0, None)
    centres = low + np.outer(depth, [0.0, 0.0, 1.0])
    centres = centres + np.outer(at, [0.0, 1.0, 0.0])
    ones = np.ones(len(at))
    right, front = np.outer(ones, [-1.0, 0.0, 0.0]), np.outer(ones, [0.0, 0.0, 1.0])  # across x front is up
    points, triangles, _ = loft(Sections(centres, right, front, wide, fore, aft, column(5)), _SECTORS)
    return MannequinPart(points, triangles, _spine_weights(rig, points[:, 1], len(points)), BODY)


def _half_distance(rig: MannequinRig, role: str) -> float:
    return float(np.linalg.norm(rig.at(f"Left{role}") - rig.at(f"Right{role}"))) / 2


def _spine_weights(rig: MannequinRig, heights: Array, count: int) -> Array:
    """Weights by height: each joint of the spine replaces the one below it."""
    half_width = 0.11 * (rig.shoulder_centre[1] - rig.hip_centre[1]) + 0.01
    above = [np.ones(count)]
    for role in _SPINE[1:]:
        above.append(np.minimum(above[-1], smoothstep(heights, rig.at(role)[1], half_width)))
    shares = {
        role: above[k] - (above[k + 1] if k + 1 < len(_SPINE) else 0.0) for k, role in enumerate(_SPINE)
    }
    return rig.weights(shares, count)


def _yoke(rig: MannequinRig, side: str) -> MannequinPart:
    """Return the loft from the middle of the chest to the shoulder; its far half follows the clavicle."""
    shoulder, g = rig.at(f"{side}Arm"), rig.girth
    middle = rig.shoulder_centre
    out = shoulder - middle
    reach = float(np.linalg.norm(out))
    tangent = out / reach
    start, stop = 0.2 * reach, reach + 0.022 * g
    caps = (0.02 * g, 0.030 * g)
    at = capped_places(start, stop, *caps, 8, hidden=1)
    share = at / reach
    round_off = dome(at, start, stop, *caps) * rig.build.shoulder
    high = course([(0.0, 0.062), (0.45, 0.058), (0.8, 0.052), (1.1, 0.047)], share) * g * round_off
    under = course([(0.0, 0.09), (0.5, 0.085), (0.8, 0.064), (1.1, 0.05)], share) * g * round_off
    deep = course([(0.0, 0.07), (0.5, 0.072), (0.8, 0.060), (1.1, 0.048)], share) * g * round_off
    lift = course([(0.0, 0.02), (0.6, 0.012), (1.0, 0.0)], share) * g
    ones = np.ones(len(at))
    front = np.array([0.0, 1.0, 0.0])
    across = np.cross(front, tangent)
    across /= np.linalg.norm(across)
    centres = middle + np.outer(at, tangent) + np.outer(lift, front)
    sections = Sections(
        centres,
        np.outer(ones, across),
        np.outer(ones, np.cross(tangent, across)),
        deep,
        high,
        under,
        2.2 * ones,
    )
    points, triangles, section = loft(sections, 18)
    far = smoothstep(share, 0.45, 0.3)[section]
    return MannequinPart(
        points, triangles, rig.weights({"Spine2": 1.0 - far, f"{side}Shoulder": far}, len(points)), BODY
    )
