"""Hands: the cameras' hand states, fused, open and close the fingers."""

import numpy as np
from numpy.typing import NDArray

from studio.engine.frames import HandSeen
from studio.engine.joints import FINGERS, OUTPUT_INDEX, OUTPUT_PARENTS

CLOSE_S = 0.12
"""Time constant with which the fingers follow the hand's state [s]."""

RELAXED = 0.25
"""How far the fingers of a hand of unknown state are closed, 0..1."""

# Bend of the three joints of a finger in a fist [deg]: Norkin & White 2016, ends of flexion.
_FIST_DEG = (80.0, 95.0, 60.0)
_FIST_THUMB_DEG = (25.0, 40.0, 50.0)


def _bends() -> tuple[NDArray[np.int64], NDArray[np.float64], NDArray[np.float64]]:
    """Finger joints of both hands, shape (3, 10), from the knuckles outward, left then right; their bend in a fist
    [rad], shape (3, 10); and the cross-product matrices of their unit axes, shape (3, 10, 3, 3)."""
    joints, angles, crosses = [], [], []
    for k in range(3):
        for side, sign in (("Left", 1.0), ("Right", -1.0)):
            for finger in FINGERS:
                thumb = finger == "Thumb"
                axis = np.array([-0.35, sign * 0.35, -sign * 0.85] if thumb else [0.0, sign, 0.0])
                x, y, z = axis / np.linalg.norm(axis)
                joints.append(OUTPUT_INDEX[f"{side}Hand{finger}{k + 1}"])
                angles.append(np.radians((_FIST_THUMB_DEG if thumb else _FIST_DEG)[k]))
                crosses.append([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.reshape(joints, (3, 10)), np.reshape(angles, (3, 10)), np.reshape(crosses, (3, 10, 3, 3))


_JOINTS, _FIST_RAD, _CROSS = _bends()
_CROSS_TWICE = _CROSS @ _CROSS
_SIDES = ("left", "right")


class Hands:
    """Closes the fingers by the hand states of one method (`circles` or `shape`)."""

    def __init__(self, method: str) -> None:
        self._method = method
        self._closed = np.full(2, RELAXED)

    def apply(self, rotations: NDArray[np.float64], seen: tuple[HandSeen, ...], dt: float) -> None:
        """Set the fingers' world rotations, in place, in `rotations`, shape (52, 3, 3).

        A hand's state is the mean over cameras, each as sure as it is far from 0.5.
        """
        wanted = np.array([self._wanted(side, seen) for side in _SIDES])
        self._closed += (1.0 - np.exp(-dt / CLOSE_S)) * (wanted - self._closed)
        angle = (np.repeat(self._closed, len(FINGERS)) * _FIST_RAD)[..., None, None]
        turns = np.eye(3) + np.sin(angle) * _CROSS + (1.0 - np.cos(angle)) * _CROSS_TWICE
        for joints, turn in zip(_JOINTS, turns, strict=True):
            rotations[joints] = rotations[OUTPUT_PARENTS[joints]] @ turn

    def _wanted(self, side: str, seen: tuple[HandSeen, ...]) -> float:
        """How far the hand should be closed, 0..1."""
        states = np.array([h.open_probability for h in seen if h.side == side and h.method == self._method])
        sure = np.abs(states - 0.5)
        if sure.sum() <= 0.05:
            return RELAXED
        return 1.0 - float(states @ sure / sure.sum())
