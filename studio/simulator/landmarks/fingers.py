"""True hands of simulated performers: their proportions, and fingers that move from gesture to gesture.

Bone lengths are from X-rays: Buryanov & Kotiuk, "Proportions of hand segments", Int. J. Morphol. 28(3), 2010. They
vary with the performer, as do the ratios of the fingers' last joints and the axes of the thumb. Solvers know none of
this.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from studio.engine.base.geometry import cross, unit
from studio.engine.model.joints import INDEX
from studio.simulator.joints.bone_frames import bone_frames

Array = NDArray[np.float64]
LANDMARKS = 21
"""The wrist, then four per finger from the thumb on, root to tip."""

_KNUCKLE = 0.0925
"""From the wrist to the middle finger's knuckle in the table's hand [m]."""

# Hand axes: x from the wrist to the fingers, y to the side of the thumb, z out of the back of the hand.
# Per finger: root, lengths of three bones, and spread when open [m, rad].
_TABLE: tuple[tuple[tuple[float, ...], tuple[float, ...], float], ...] = (
    ((0.020, 0.022, -0.010), (0.0462, 0.0316, 0.0256), 0.75),
    ((0.0915, 0.024, 0.000), (0.0398, 0.0224, 0.0196), 0.09),
    ((0.0925, 0.003, 0.002), (0.0446, 0.0263, 0.0214), 0.00),
    ((0.0860, -0.016, 0.001), (0.0414, 0.0257, 0.0213), -0.08),
    ((0.0790, -0.033, -0.003), (0.0327, 0.0181, 0.0196), -0.19),
)
_DIP = 0.33
"""Angle of the open thumb towards the palm [rad]."""

# Gestures [rad]. Thumb: abduction, flexion, and bends of its last joints. Fingers: bends of the first and the second
# joint, and spread.
_FLAT, _CURLED, _HALF = (0.02, 0.05, 0.0), (1.35, 1.6, 0.0), (0.6, 0.9, 0.0)
_GESTURES: tuple[tuple[tuple[float, ...], ...], ...] = (
    ((0.1, 0.0, 0.1, 0.1), _FLAT, _FLAT, _FLAT, _FLAT),
    ((0.5, 0.4, 0.6, 0.7), _CURLED, _CURLED, _CURLED, _CURLED),
    ((0.4, 0.4, 0.5, 0.6), _FLAT, _CURLED, _CURLED, _CURLED),
    ((0.4, 0.4, 0.6, 0.6), (0.0, 0.1, 0.12), (0.0, 0.1, -0.05), _CURLED, _CURLED),
    ((0.6, 0.2, 0.4, 0.5), (0.75, 0.85, 0.0), (0.3, 0.3, 0.0), (0.25, 0.3, 0.0), (0.2, 0.3, 0.0)),
    ((0.0, -0.2, 0.0, 0.0), _CURLED, _CURLED, _CURLED, _CURLED),
    ((0.0, -0.2, 0.0, 0.0), (0.0, 0.0, 0.2), (0.0, 0.0, 0.03), (0.0, 0.0, -0.1), (0.0, 0.0, -0.25)),
    ((0.4, 0.1, 0.3, 0.3), _HALF, _HALF, _HALF, _HALF),
    ((0.2, 0.1, 0.2, 0.2), (0.3, 0.35, 0.0), (0.35, 0.4, 0.0), (0.4, 0.45, 0.0), (0.45, 0.5, 0.0)),
)
_HELD_S, _CHANGE_S = (0.4, 1.6), (0.2, 0.5)
_VARIES = 0.05
_SEEN_OFF = 0.015
_BENT_BACK = 0.08
STREAM = 0x48
"""Key of the hands' own random numbers, so that those of bodies do not change."""

_PRONATION = 0.8
"""Largest turn of the forearms to either side [rad]."""

_STRAIGHT, _BENT = 0.2, 0.5
"""Sines of the elbow angle over which it starts to determine the forearm's turn."""

_ROUND_S = 60.0
"""Time after which the gestures repeat."""


@dataclass(frozen=True)
class _GestureCourse:
    """Gestures of one hand, each reached at `reached_s` and held until `left_s`; angles, shape (n, 5, 4)."""

    reached_s: Array
    left_s: Array
    angles: Array

    @classmethod
    def random(cls, rng: np.random.Generator) -> "_GestureCourse":
        reached, left, angles, time_s = [], [], [], 0.0
        table = np.array([[(*values, 0.0)[:4] for values in gesture] for gesture in _GESTURES])
        while time_s < _ROUND_S:
            reached.append(time_s)
            left.append(time_s + rng.uniform(*_HELD_S))
            angles.append(table[rng.integers(len(table))] + rng.normal(0.0, _BENT_BACK, (5, 4)))
            time_s = left[-1] + rng.uniform(*_CHANGE_S)
        angles[-1] = angles[0]
        return cls(np.array(reached), np.array(left), np.array(angles))

    def at(self, time_s: float) -> Array:
        """Angles at a time, shape (5, 4)."""
        time_s %= float(self.left_s[-1])
        k = int(np.searchsorted(self.reached_s, time_s, side="right")) - 1
        if time_s <= self.left_s[k]:
            return self.angles[k]
        share = (time_s - self.left_s[k]) / (self.reached_s[k + 1] - self.left_s[k])
        share = share * share * (3.0 - 2.0 * share)
        return (1.0 - share) * self.angles[k] + share * self.angles[k + 1]


class SimulatedHands:
    """Both hands of one performer.

    Args:
        body_m: T-pose offsets of the performer, shape (21, 3); see `CanonicalMotion`.
        seed: of proportions and gestures.

    Attributes:
        length_m: length of the stretched hand, from wrist to middle fingertip.
        seen_off: offset at which networks see each landmark, as a share of the length, shape (2, 21, 3).
    """

    def __init__(self, body_m: Array, seed: int) -> None:
        rng = np.random.default_rng([seed, STREAM])
        self._body = body_m
        scale = float(np.linalg.norm(body_m[INDEX["left_hand"]])) / _KNUCKLE
        self._roots = (
            scale * np.array([root for root, _, _ in _TABLE]) * rng.normal(1.0, 0.5 * _VARIES, (5, 1))
        )
        self._bones = scale * np.array([bones for _, bones, _ in _TABLE]) * rng.normal(1.0, _VARIES, (5, 3))
        self._spread = np.array([spread for _, _, spread in _TABLE]) + rng.normal(0.0, 0.03, 5)
        self._follows = rng.uniform(0.5, 0.85, 5)
        self._across = np.array([0.55, -0.6, -0.58]) + rng.normal(0.0, 0.08, 3)
        self._courses = tuple(_GestureCourse.random(rng) for _ in range(2))
        self._turn_phase, self._turn_hz = rng.uniform(0.0, 6.28, 2), rng.uniform(0.08, 0.2, 2)
        self.seen_off = rng.normal(0.0, _SEEN_OFF, (2, LANDMARKS, 3))
        self.length_m = float(self._roots[2, 0] + self._bones[2].sum())

    def points(self, joints_m: Array, time_s: float) -> Array:
        """Return the landmarks of the left and the right hand in the stage frame [m], shape (2, 21, 3).

        Args:
            joints_m: true joint centres, shape (21, 3).
            time_s: time that sets the pose of the fingers.
        """
        frames = bone_frames(joints_m[None], self._body)[0]
        out = np.empty((2, LANDMARKS, 3))
        for k, side in enumerate(("left", "right")):
            turn = _PRONATION * np.sin(6.283 * self._turn_hz[k] * time_s + self._turn_phase[k])
            shoulder, elbow, wrist, hand = (
                joints_m[INDEX[f"{side}_{joint}"]] for joint in ("shoulder", "elbow", "wrist", "hand")
            )
            along = unit(hand - wrist)
            thumb = _thumb_side(-frames[INDEX[f"{side}_wrist"], :, 1], along, shoulder - elbow, wrist - elbow)
            back = cross(thumb, along) * (1.0 if k == 0 else -1.0)
            axes = np.array(
                [
                    along,
                    np.cos(turn) * thumb + np.sin(turn) * back,
                    np.cos(turn) * back - np.sin(turn) * thumb,
                ]
            )
            out[k] = wrist + self._in_hand(self._courses[k].at(time_s)) @ axes
        return out

    def _in_hand(self, angles: Array) -> Array:
        """Landmarks in hand axes for a gesture's angles, shape (21, 3)."""
        points = np.zeros((LANDMARKS, 3))
        for f in range(5):
            at = self._roots[f]
            points[1 + 4 * f] = at
            if f == 0:
                abduction, flexion, second, last = angles[0]
                spread, dip = self._spread[0] - flexion, _DIP + abduction
                bends = (0.0, max(second, 0.0), last)
                way = np.array([np.cos(spread) * np.cos(dip), np.sin(spread) * np.cos(dip), -np.sin(dip)])
                down = self._across - (self._across @ way) * way
            else:
                first, second, side, _ = angles[f]
                spread = self._spread[f] + side
                bends = (first, max(second, 0.0), self._follows[f] * max(second, 0.0))
                way = np.array([np.cos(spread), np.sin(spread), 0.0])
                down = np.array([0.0, 0.0, -1.0]) + 0.5 * spread * np.array(
                    [np.sin(spread), -np.cos(spread), 0.0]
                )
            down = down / np.linalg.norm(down)
            bend = 0.0
            for k in range(3):
                bend += bends[k]
                at = at + self._bones[f, k] * (np.cos(bend) * way + np.sin(bend) * down)
                points[2 + 4 * f + k] = at
        return points


def _thumb_side(straight: Array, along: Array, upper: Array, fore: Array) -> Array:
    """Return the direction of a hand's thumb side with the forearm neither pronated nor supinated, shape (3,).

    A bent elbow moves the hand to that side (Kapandji, "The physiology of the joints", vol. 1). For a straight arm,
    it is the thumb side of an arm without twist.

    Args:
        straight: thumb side of a straight arm.
        along: unit vector from the wrist to the knuckles.
        upper, fore: vectors from the elbow to shoulder and wrist.
    """
    straight = unit(straight - (straight @ along) * along)
    bent = upper - (upper @ along) * along
    share = np.clip(
        (np.linalg.norm(cross(unit(upper), unit(fore))) - _STRAIGHT) / (_BENT - _STRAIGHT), 0.0, 1.0
    )
    if share == 0.0 or np.linalg.norm(bent) < 1e-6:
        return straight
    angle = share * np.arctan2(cross(straight, unit(bent)) @ along, straight @ unit(bent))
    return np.cos(angle) * straight + np.sin(angle) * cross(along, straight)
