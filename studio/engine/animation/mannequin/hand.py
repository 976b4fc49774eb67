"""Hands: a palm and five fingers that bend, or a mitten where the skeleton has no fingers."""

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from studio.engine.animation.mannequin.loft import Sections, capped_places, course, dome, loft, smoothstep
from studio.engine.animation.mannequin.mesh import BODY, MannequinPart
from studio.engine.animation.mannequin.rig import MannequinRig
from studio.engine.model.joints import FINGERS

Array = NDArray[np.float64]

_USUAL_PALM_M = 0.088
_RADIUS = {"Thumb": 0.0108, "Index": 0.0090, "Middle": 0.0093, "Ring": 0.0088, "Pinky": 0.0077}
_TIP = 0.85
"""Length of a finger's last bone relative to the one before."""

_MITTEN_OF_FOREARM = 0.62


def hand(rig: MannequinRig, side: str) -> list[MannequinPart]:
    """Return the parts of one hand."""
    fingers = fingers_of(rig, side)
    frame = HandFrame(rig, side)
    parts = [_palm(rig, side, frame, mitten=len(fingers) < len(FINGERS) - 1)]
    return parts + [_finger(rig, side, finger, frame) for finger in fingers]


def fingers_of(rig: MannequinRig, side: str) -> list[str]:
    """Return the fingers of a hand that have all their joints."""
    return [finger for finger in FINGERS if all(rig.has(f"{side}Hand{finger}{k}") for k in (1, 2, 3))]


class HandFrame:
    """Axes and size of a hand at rest: along it, towards the thumb, and out of its back."""

    def __init__(self, rig: MannequinRig, side: str) -> None:
        self.wrist = rig.at(f"{side}Hand")
        forearm = self.wrist - rig.at(f"{side}ForeArm")
        knuckles = [f"{side}Hand{f}1" for f in FINGERS[1:] if rig.has(f"{side}Hand{f}1")]
        if len(knuckles) >= 2:
            ends = rig.at(knuckles[0]), rig.at(knuckles[-1])
            self.end = np.mean([rig.at(name) for name in knuckles], axis=0)
            thumb = ends[0] - ends[1]
            self.half_width = 0.5 * float(np.linalg.norm(thumb))
        else:
            self.end = self.wrist + forearm * 0.5 * _MITTEN_OF_FOREARM
            thumb = np.array([0.0, 0.0, 1.0])
            self.half_width = 0.0
        along = self.end - self.wrist
        self.length = float(np.linalg.norm(along))
        if self.length < 1e-3 * rig.stature:
            along, self.length = forearm, 0.05 * rig.stature
        self.along = along / np.linalg.norm(along)
        self.thumb = thumb - (thumb @ self.along) * self.along
        self.thumb /= np.linalg.norm(self.thumb)
        self.back = np.cross(self.thumb, self.along) * (1.0 if side == "Left" else -1.0)
        self.size = max(self.length, 0.045 * rig.stature) / _USUAL_PALM_M
        self.half_width = max(self.half_width, 0.026 * self.size)


def _palm(rig: MannequinRig, side: str, frame: HandFrame, *, mitten: bool) -> MannequinPart:
    size, build = frame.size, rig.build.hand
    stop = frame.length * (1.9 if mitten else 1.0) + 0.011 * size
    start = 0.004 * size
    caps = (0.010 * size, (0.030 if mitten else 0.012) * size)
    at = capped_places(start, stop, *caps, 6, hidden=1)
    share = (at - start) / (stop - start)
    round_off = dome(at, start, stop, *caps)
    knuckle = frame.half_width + 0.0105 * size * build
    wide = course(
        [
            (0.0, 0.026 * size * build),
            (0.35, 0.5 * (0.029 * size * build + knuckle)),
            (0.8, knuckle),
            (1.0, 0.96 * knuckle),
        ],
        share,
    )
    thick = course([(0.0, 0.0215), (0.3, 0.0175), (0.75, 0.0135), (1.0, 0.0110)], share) * size * build
    ones = np.ones(len(at))
    across = frame.thumb if side == "Left" else -frame.thumb
    up = np.cross(frame.along, across)
    centres = frame.wrist + np.outer(at, frame.along) - np.outer(0.003 * size * share, frame.back)
    sections = Sections(
        centres, np.outer(ones, across), np.outer(ones, up), wide * round_off, thick * round_off,
        thick * round_off, course([(0.0, 2.1), (1.0, 2.7)], share),
    )  # fmt: skip
    points, triangles, _ = loft(sections, 16)
    return MannequinPart(points, triangles, rig.weights({f"{side}Hand": 1.0}, len(points)), BODY)


def _finger(rig: MannequinRig, side: str, finger: str, frame: HandFrame) -> MannequinPart:
    roles = [f"{side}Hand{finger}{k}" for k in (1, 2, 3)]
    joints = [rig.at(role) for role in roles]
    joints.append(joints[2] + _TIP * (joints[2] - joints[1]))
    if finger == "Thumb":  # the thumb starts in the palm near the wrist
        joints[0] = frame.wrist + 0.6 * (joints[0] - frame.wrist) + 0.1 * (joints[1] - frame.wrist)
    lengths = np.linalg.norm(np.diff(joints, axis=0), axis=1)
    places = np.concatenate([[0.0], np.cumsum(lengths)])
    radius = _RADIUS[finger] * frame.size * rig.build.hand
    start, stop = -0.6 * radius, places[-1] + 0.15 * radius
    caps = ((2.6 if finger == "Thumb" else 0.8) * radius, 1.5 * radius)
    blend = [min(0.9 * radius, 0.42 * min(pair)) for pair in pairwise(lengths)]
    at = [capped_places(start, stop, *caps, 3, hidden=1)]
    at += [places[k + 1] + blend[k] * np.array([-1, -0.35, 0.0, 0.35, 1]) for k in range(2)]
    at = np.unique(np.round(np.concatenate(at), 6))
    root = (
        [(0.0, 1.5), (0.45 * places[1], 1.65)] if finger == "Thumb" else [(0.0, 1.06)]
    )  # the ball of the thumb
    knots = [
        *root,
        (places[1], 1.02),
        ((places[1] + places[2]) / 2, 0.93),
        (places[2], 0.96),
        (places[3], 0.80),
    ]
    groove = sum(0.06 * np.exp(-(((at - places[k]) / (0.22 * radius)) ** 2)) for k in (1, 2))
    rounded = (course(knots, at) - groove) * radius * dome(at, start, stop, *caps)
    centres = np.stack([_extended(at, places, [j[k] for j in joints]) for k in range(3)], axis=1)
    tangents = np.gradient(centres, at, axis=0)
    tangents /= np.linalg.norm(tangents, axis=1, keepdims=True)
    across = np.cross(frame.back, tangents)
    across /= np.linalg.norm(across, axis=1, keepdims=True)
    sections = Sections(
        centres,
        across,
        np.cross(tangents, across),
        rounded,
        0.94 * rounded,
        0.94 * rounded,
        np.full(len(at), 2.1),
    )
    points, triangles, section = loft(sections, 8)
    second, third = (smoothstep(at, places[k + 1], blend[k])[section] for k in range(2))
    third = np.minimum(second, third)
    shares = {roles[0]: 1.0 - second, roles[1]: second - third, roles[2]: third}
    return MannequinPart(points, triangles, rig.weights(shares, len(points)), BODY)


def _extended(at: Array, places: Array, values: list[float]) -> Array:
    """Linear interpolation between places, and extrapolation beyond both ends."""
    out = np.interp(at, places, values)
    for end, other, beyond in ((0, 1, at < places[0]), (-1, -2, at > places[-1])):
        slope = (values[end] - values[other]) / (places[end] - places[other])
        out[beyond] = values[end] + slope * (at[beyond] - places[end])
    return out
