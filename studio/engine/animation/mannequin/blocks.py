"""The body of blocks: a rigid block for each bone and a ball in each joint, so that every turn of a limb shows."""

import numpy as np
from numpy.typing import NDArray

from studio.engine.animation.mannequin.foot import foot_frame
from studio.engine.animation.mannequin.hand import HandFrame, fingers_of
from studio.engine.animation.mannequin.limbs import ball
from studio.engine.animation.mannequin.loft import Sections, capped_places, dome, loft
from studio.engine.animation.mannequin.mesh import BODY, SEAM, MannequinPart
from studio.engine.animation.mannequin.rig import MannequinRig

Array = NDArray[np.float64]

_UP, _AHEAD = np.array([0.0, 1.0, 0.0]), np.array([0.0, 0.0, 1.0])
_SQUARE = 6.0
"""Exponent of the blocks' outline: a rounded rectangle."""

# Joint, from and to which height (0 = hip joints, 1 = shoulder joints), half-width as a share of the hip joints'
# and of the shoulder joints' half distance plus metres at a stature of 1.75 m, half-depth [m].
_TRUNK = (
    ("Hips", -0.20, 0.15, 1.0, 0.0, 0.062, 0.088),
    ("Spine", 0.165, 0.315, 0.4, 0.45, 0.010, 0.072),
    ("Spine1", 0.33, 0.475, 0.2, 0.62, 0.010, 0.076),
    ("Spine2", 0.49, 1.03, 0.0, 1.0, -0.030, 0.098),
)
# Root, middle and end of a limb; half-widths and half-depths of both bones, radii of the balls [m].
_ARM = ("Arm", "ForeArm", "Hand"), ((0.036, 0.040), (0.027, 0.031)), (0.047, 0.037, 0.027)
_LEG = ("UpLeg", "Leg", "Foot"), ((0.056, 0.064), (0.041, 0.047)), (0.056, 0.051, 0.037)
_SOLE_M, _HEEL_M, _TOES_M = 0.052, 0.058, 0.070
_USUAL_RADIUS_M = 0.0082


def blocks(rig: MannequinRig) -> list[MannequinPart]:
    """Return all parts of the body."""
    parts = [*_trunk(rig), *_head(rig)]
    for side in ("Left", "Right"):
        for roles, halves, radii in (_ARM, _LEG):
            parts += _limb(rig, [side + role for role in roles], halves, radii)
        parts += [_collar(rig, side), *_hand(rig, side), *_foot(rig, side)]
    return parts


def block(
    rig: MannequinRig, role: str, ends: tuple[Array, Array], front: Array, half: tuple[float, float],
    *, tone: int = BODY, sectors: int = 16,
) -> MannequinPart:  # fmt: skip
    """Return a block that follows one joint.

    Args:
        rig: the joints; role: of the joint.
        ends: middles of its two ends, each shape (3,).
        front: direction of its depth; the component along the block is removed.
        half: half-width and half-depth [m].
        tone: `BODY` or `SEAM`; sectors: of the outline.
    """
    way = ends[1] - ends[0]
    length = max(float(np.linalg.norm(way)), 1e-3 * rig.stature)
    along = way / max(float(np.linalg.norm(way)), 1e-9)
    ahead = front - (front @ along) * along
    ahead /= np.linalg.norm(ahead)
    cap = min(0.25 * length, 0.35 * min(half))
    at = capped_places(0.0, length, cap, cap, 2, hidden=0 if sectors > 8 else 2)
    round_off, ones = dome(at, 0.0, length, cap, cap), np.ones(len(at))
    sections = Sections(
        ends[0] + np.outer(at, along), np.outer(ones, np.cross(ahead, along)), np.outer(ones, ahead),
        half[0] * round_off, half[1] * round_off, half[1] * round_off, _SQUARE * ones,
    )  # fmt: skip
    points, triangles, _ = loft(sections, sectors)
    return MannequinPart(points, triangles, rig.weights({role: 1.0}, len(points)), tone)


def _trunk(rig: MannequinRig) -> list[MannequinPart]:
    low, high, g = rig.hip_centre, rig.shoulder_centre, rig.girth
    hips, shoulders = (
        float(np.linalg.norm(rig.at(f"Left{role}") - rig.at(f"Right{role}"))) / 2 for role in ("UpLeg", "Arm")
    )
    return [
        block(
            rig, role, (low + begin * (high - low), low + end * (high - low)), _AHEAD,
            (of_hips * hips + of_shoulders * shoulders + more * g, deep * g),
        )
        for role, begin, end, of_hips, of_shoulders, more, deep in _TRUNK
    ]  # fmt: skip


def _head(rig: MannequinRig) -> list[MannequinPart]:
    """The neck, the head, and a visor where the eyes are."""
    g, height = rig.girth, rig.head_height
    crown, joint = rig.floor + rig.stature, rig.at("Head")
    chin = max(crown - height, float(rig.shoulder_centre[1]) + 0.03 * g)
    middle = np.array([joint[0], chin, joint[2] + 0.01 * height])
    tall = crown - chin
    eyes = middle + 0.56 * tall * _UP + 0.30 * height * _AHEAD
    neck = rig.shoulder_centre, middle + 0.2 * tall * _UP
    return [
        block(rig, "Neck", neck, _AHEAD, (0.046 * g, 0.046 * g), tone=SEAM),
        block(rig, "Head", (middle, middle + tall * _UP), _AHEAD, (0.31 * height, 0.38 * height)),
        block(rig, "Head", (eyes, eyes + 0.11 * height * _AHEAD), _UP, (0.24 * height, 0.09 * height), tone=SEAM),
    ]  # fmt: skip


def _limb(
    rig: MannequinRig, roles: list[str], halves: tuple[tuple[float, float], ...], radii: tuple[float, ...]
) -> list[MannequinPart]:
    """Two bones that end at the balls of their joints."""
    g = rig.girth
    joints = [rig.at(role) for role in roles]
    parts = [
        ball(rig, role, joint, np.full(3, radius * g), SEAM)
        for role, joint, radius in zip(roles, joints, radii, strict=True)
    ]
    for k, half in enumerate(halves):
        way = joints[k + 1] - joints[k]
        along = way / np.linalg.norm(way)
        ends = joints[k] + 0.7 * radii[k] * g * along, joints[k + 1] - 0.7 * radii[k + 1] * g * along
        parts.append(block(rig, roles[k], ends, _AHEAD, (half[0] * g, half[1] * g)))
    return parts


def _collar(rig: MannequinRig, side: str) -> MannequinPart:
    middle, shoulder, g = rig.shoulder_centre, rig.at(f"{side}Arm"), rig.girth
    lift = 0.012 * g * _UP
    ends = middle + 0.12 * (shoulder - middle) + lift, middle + 0.86 * (shoulder - middle) + lift
    return block(rig, f"{side}Shoulder", ends, _AHEAD, (0.040 * g, 0.058 * g))


def _hand(rig: MannequinRig, side: str) -> list[MannequinPart]:
    frame, fingers = HandFrame(rig, side), fingers_of(rig, side)
    reach = frame.length * (0.96 if fingers else 1.9)
    palm = (frame.wrist + 0.014 * frame.size * frame.along, frame.wrist + reach * frame.along)
    wide = frame.half_width + 0.009 * frame.size
    parts = [block(rig, f"{side}Hand", palm, frame.back, (wide, 0.0115 * frame.size))]
    radius = _USUAL_RADIUS_M * frame.size
    for finger in fingers:
        joints = [rig.at(f"{side}Hand{finger}{k}") for k in (1, 2, 3)]
        joints.append(joints[2] + 0.85 * (joints[2] - joints[1]))
        for k in range(3):
            way = joints[k + 1] - joints[k]
            ends = joints[k] + 0.03 * way, joints[k + 1] - 0.05 * way
            role = f"{side}Hand{finger}{k + 1}"
            parts.append(block(rig, role, ends, frame.back, (radius, 0.9 * radius), sectors=8))
    return parts


def _foot(rig: MannequinRig, side: str) -> list[MannequinPart]:
    ankle, size, forward, toes = foot_frame(rig, side)
    half = 0.5 * _SOLE_M * size
    middle = np.array([ankle[0], rig.floor + half, ankle[2]])
    bend = float((rig.at(f"{side}ToeBase") - ankle) @ forward) if toes else 0.145 * size
    ends = (-_HEEL_M * size, bend - 0.004 * size, bend + 0.004 * size, bend + _TOES_M * size)
    heel, before, after, tip = (middle + at * forward for at in ends)
    low = np.array([0.0, 0.4 * half, 0.0])
    return [
        block(rig, f"{side}Foot", (heel, before), _UP, (0.041 * size, half)),
        block(rig, f"{side}ToeBase", (after - low, tip - low), _UP, (0.045 * size, 0.6 * half)),
    ]
