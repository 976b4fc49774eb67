"""Motions in which hands touch the body, for any performer: washing, combing, folding the arms."""

from functools import cache

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from studio.engine.animation.motion.composer import compose
from studio.engine.animation.motion.keys import FloorPath, Keys
from studio.engine.animation.motion.motion import CanonicalMotion
from studio.engine.model.joints import INDEX
from studio.simulator.body.performers import Actor
from studio.simulator.body.proportions import performer_offsets

Array = NDArray[np.float64]
_SIDES = ("left", "right")
_ARM = ("raise", "plane", "roll", "elbow")
_T_POSE = {"raise": np.pi / 2, "plane": 0.0, "roll": 0.0, "elbow": 0.0}
_HANG = {"raise": 0.14, "plane": 0.0, "roll": 0.0, "elbow": 0.22}
_EASY = (0.8, 1.2, 0.6, 1.8)
"""Start of the search for an arm's angles [rad]."""
T_POSE_S = 2.0
"""Length of the T-pose at the beginning of every motion, in which the body's shape is found."""

Place = tuple[str, float, float, float]
"""A joint, and how far beside (to the hand's own side), in front of and above it the knuckles are, as shares of
stature."""
_FACE: Place = ("head", 0.025, 0.075, 0.0)
_CHEEK: Place = ("head", 0.045, 0.060, -0.03)
_BROW: Place = ("head", 0.02, 0.075, 0.045)
_CROWN: Place = ("head", 0.02, 0.02, 0.085)
_BACK_OF_HEAD: Place = ("head", 0.04, -0.05, 0.06)
_CHEST: Place = ("chest", 0.03, 0.10, 0.05)
_BELLY: Place = ("spine", 0.04, 0.105, 0.0)


@cache
def _arm(performer: Actor, side: str, place: Place) -> dict[str, float]:
    """Return the channels of an arm whose knuckles are at a place, while the performer stands upright."""
    offsets = performer_offsets(performer)
    joint, *shares = place
    sign = 1.0 if side == "left" else -1.0
    off = np.array([sign * shares[0], -shares[1], shares[2]]) * performer.height_m

    def lacking(angles: Array) -> Array:
        keys, path = Keys(), FloorPath()
        path.wait(0.1)
        keys.move(0.0, 0.0, **{f"{side}_{n}": float(a) for n, a in zip(_ARM, angles, strict=True)})
        positions = compose(offsets, keys, path, 0.05).positions_m[-1]
        away = positions[INDEX[f"{side}_hand"]] - positions[INDEX[joint]] - off
        return np.concatenate([away / 0.01, 0.3 * (angles - _EASY)])

    found = least_squares(lacking, _EASY, bounds=([-0.5, -0.3, -1.0, 0.0], [2.6, 2.2, 2.0, 2.5]))
    return {f"{side}_{n}": float(a) for n, a in zip(_ARM, found.x, strict=True)}


class _Motion:
    """A T-pose, then arms down; further motion is appended."""

    def __init__(self, performer: Actor) -> None:
        self.performer = performer
        self.keys, self.path, self.now = Keys(), FloorPath(), T_POSE_S
        self.keys.move(0.0, 0.0, **_both(_T_POSE))
        self.to(0.8, _both(_HANG))
        self.hold(0.3)

    def to(self, duration_s: float, channels: dict[str, float]) -> None:
        self.keys.move(self.now, self.now + duration_s, **channels)
        self.hold(duration_s)

    def hold(self, duration_s: float) -> None:
        self.now += duration_s
        self.path.wait(self.now - self.path.end_s)

    def rub(self, places: list[Place], times: int, stroke_s: float, sides: tuple[str, ...] = _SIDES) -> None:
        """Move the hands to the first place, then from place to place."""
        for k in range(times):
            for n, place in enumerate(places):
                first = k == n == 0
                channels: dict[str, float] = {}
                for side in sides:
                    channels |= _arm(self.performer, side, place)
                self.to(0.7 if first else stroke_s, channels)

    def motion(self) -> CanonicalMotion:
        return compose(performer_offsets(self.performer), self.keys, self.path, self.now)


def _both(values: dict[str, float]) -> dict[str, float]:
    return {f"{side}_{name}": value for side in _SIDES for name, value in values.items()}


def hands_at_body(performer: Actor) -> CanonicalMotion:
    """Washing face and trunk, combing with the right and with the left hand, folding the arms; 22 s."""
    motion = _Motion(performer)
    washing(motion)
    combing(motion)
    folding(motion)
    return motion.motion()


def short_washing(performer: Actor) -> CanonicalMotion:
    """Washing the face and the chest, 6 s."""
    motion = _Motion(performer)
    motion.rub([_FACE, _CHEEK], 2, 0.35)
    motion.rub([_CHEST], 1, 0.4)
    motion.hold(0.5)
    return motion.motion()


def washing(motion: _Motion) -> None:
    """Append both hands rubbing the face, then chest and belly."""
    motion.rub([_FACE, _CHEEK, _BROW], 3, 0.3)
    motion.rub([_CHEST, _BELLY], 3, 0.4)
    motion.to(0.6, _both(_HANG))
    motion.hold(0.3)


def combing(motion: _Motion) -> None:
    """Append strokes over the head, with either hand."""
    for side in reversed(_SIDES):
        motion.rub([_BROW, _CROWN, _BACK_OF_HEAD], 3, 0.35, (side,))
        motion.to(0.6, _both(_HANG))
    motion.hold(0.3)


def folding(motion: _Motion) -> None:
    """Append arms folded in front of the chest, held and opened again."""
    under = {"raise": 0.5, "plane": 1.5, "roll": 1.4, "elbow": 1.6}
    over = {"raise": 0.7, "plane": 1.5, "roll": 1.15, "elbow": 1.6}
    motion.to(0.8, {f"left_{name}": value for name, value in under.items()})
    motion.to(0.6, {f"right_{name}": value for name, value in over.items()})
    motion.hold(1.2)
    motion.to(0.8, _both(_HANG))
    motion.hold(0.4)
