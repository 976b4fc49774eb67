"""Head and neck: an egg with a flat face, so that its heading is visible, on a column."""

import numpy as np
from numpy.typing import NDArray

from studio.engine.animation.mannequin.loft import Sections, capped_places, course, dome, loft, smoothstep
from studio.engine.animation.mannequin.mesh import BODY, SEAM, MannequinPart
from studio.engine.animation.mannequin.rig import MannequinRig

Array = NDArray[np.float64]

_SECTORS = 24
# Height (0 = chin, 1 = crown), then shares of the head's height: half-width, depth before and behind its axis.
_TABLE = (
    (0.0, 0.130, 0.250, 0.05), (0.08, 0.185, 0.335, 0.12), (0.2, 0.243, 0.372, 0.27),
    (0.35, 0.285, 0.390, 0.38), (0.5, 0.308, 0.398, 0.44), (0.64, 0.320, 0.398, 0.465),
    (0.8, 0.325, 0.395, 0.475), (1.0, 0.325, 0.39, 0.47),
)  # fmt: skip
_NOSE = (0.40, 0.105, 0.065, 0.055)  # height, half its height, half its width, how far it stands out


def head(rig: MannequinRig) -> list[MannequinPart]:
    """Return the head and the neck."""
    return [_head(rig), _neck(rig)]


def _frame(rig: MannequinRig) -> tuple[Array, float]:
    """Return the middle of the chin's height on the head's axis, and the height of the head [m]."""
    height = rig.head_height
    crown = rig.floor + rig.stature
    chin = max(crown - height, rig.shoulder_centre[1] + 0.03 * rig.girth)
    joint = rig.at("Head")
    return np.array([joint[0], chin, joint[2] + 0.02 * height]), crown - chin


def _head(rig: MannequinRig) -> MannequinPart:
    chin, height = _frame(rig)
    at = capped_places(0.0, 1.0, 0.10, 0.42, 9)
    round_off = dome(at, 0.0, 1.0, 0.10, 0.42)
    wide, fore, aft = (
        course([(row[0], row[k]) for row in _TABLE], at) * height * round_off for k in (1, 2, 3)
    )
    wide = wide * rig.build.head
    ones = np.ones(len(at))
    sections = Sections(
        chin + np.outer(at * height, [0.0, 1.0, 0.0]),
        np.outer(ones, [-1.0, 0.0, 0.0]),
        np.outer(ones, [0.0, 0.0, 1.0]),
        wide, fore, aft, course([(0.0, 2.0), (0.3, 2.25), (0.7, 2.15), (1.0, 2.0)], at),
    )  # fmt: skip
    points, triangles, _ = loft(sections, _SECTORS)
    _raise_nose(points, chin, height)
    return MannequinPart(points, triangles, rig.weights({"Head": 1.0}, len(points)), BODY)


def _raise_nose(points: Array, chin: Array, height: float) -> None:
    """Pull the points of the nose forward, steep at the lower edge and flat at the upper."""
    place, tall, wide, out = _NOSE
    up = (points[:, 1] - chin[1]) / height - place
    side = (points[:, 0] - chin[0]) / height / wide
    before = points[:, 2] > chin[2]
    rise = np.exp(-((np.where(up > 0, up / (2.0 * tall), up / (0.55 * tall))) ** 2) - side**2)
    points[before, 2] += (out * height * rise)[before]


def _neck(rig: MannequinRig) -> MannequinPart:
    chin, height = _frame(rig)
    low = rig.shoulder_centre
    g = rig.girth
    bottom = np.array([low[0], low[1] - 0.02 * g, low[2] - 0.012 * g])
    top = np.array([chin[0], chin[1] + 0.36 * height, chin[2] - 0.10 * height])
    way = top - bottom
    length = float(np.linalg.norm(way))
    tangent = way / length
    cap = 0.1 * length
    at = capped_places(0.0, length, cap, cap, 7, hidden=2)
    share = at / length
    radius = course([(0.0, 0.066), (0.35, 0.056), (0.6, 0.053), (1.0, 0.055)], share) * g
    radius = np.minimum(radius, 0.27 * height) * dome(at, 0.0, length, cap, cap) * rig.build.neck
    ones = np.ones(len(at))
    across = np.outer(ones, [-1.0, 0.0, 0.0])
    sections = Sections(
        bottom + np.outer(at, tangent),
        across,
        np.cross(tangent, across),
        radius,
        radius,
        1.04 * radius,
        2.0 * ones,
    )
    points, triangles, section = loft(sections, 18)
    base = float(np.clip((rig.at("Neck") - bottom) @ tangent / length, 0.1, 0.5))
    to_neck = smoothstep(share, base, 0.2)[section]
    to_head = smoothstep(share, 0.72, 0.22)[section]
    shares = {"Spine2": 1.0 - to_neck, "Neck": to_neck - np.minimum(to_neck, to_head)}
    shares["Head"] = np.minimum(to_neck, to_head)
    return MannequinPart(points, triangles, rig.weights(shares, len(points)), SEAM)
