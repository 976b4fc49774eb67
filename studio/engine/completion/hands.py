"""Hands: the cameras' hand states, fused, open and close the fingers."""

import numpy as np
from numpy.typing import NDArray

from studio.engine.frames import HandSeen
from studio.engine.human.ranges import dofs_of
from studio.engine.joints import FINGERS, OUTPUT_INDEX, OUTPUT_PARENTS

CLOSE_S = 0.12
"""Time constant with which the fingers follow the hand's state [s]."""

FASTEST_PER_S = 6.0
"""Fingers close or open no faster than this [1/s]: from flat to a fist in a sixth of a second."""

RELAXED = 0.25
"""How far the fingers of a hand at rest are closed, 0..1."""

RELAX_S = 2.0
"""Time constant with which a hand of unknown state goes to rest [s]."""

# Bend of a finger's three joints in a fist [deg], just within their ranges; the last is two thirds of the
# middle one. The thumb lies over the index finger.
_FIST_DEG = (80.0, 95.0, 95.0 * 2.0 / 3.0)
_FIST_THUMB_DEG = (15.0, 45.0, 60.0)


def _fist_turn(name: str) -> NDArray[np.float64]:
    """Rotation vector of a finger joint from flat to a fist [rad], about the human model's hinge."""
    bend = next(dof for dof in dofs_of(name) if dof.name == "bend")
    degrees = (_FIST_THUMB_DEG if "Thumb" in name else _FIST_DEG)[int(name[-1]) - 1]
    return np.radians(degrees) * np.array(bend.axis)


def _bends() -> tuple[NDArray[np.int64], NDArray[np.float64], NDArray[np.float64]]:
    """Finger joints of both hands, shape (3, 10), from the knuckles outward, left then right; their bend in a fist
    [rad], shape (3, 10); and the cross-product matrices of their unit axes, shape (3, 10, 3, 3)."""
    joints, angles, crosses = [], [], []
    for k in (1, 2, 3):
        for side in ("Left", "Right"):
            for finger in FINGERS:
                name = f"{side}Hand{finger}{k}"
                turn = _fist_turn(name)
                angle = float(np.linalg.norm(turn))
                x, y, z = turn / angle
                joints.append(OUTPUT_INDEX[name])
                angles.append(angle)
                crosses.append([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.reshape(joints, (3, 10)), np.reshape(angles, (3, 10)), np.reshape(crosses, (3, 10, 3, 3))


_JOINTS, _FIST_RAD, _CROSS = _bends()
_CROSS_TWICE = _CROSS @ _CROSS
_PARENTS = OUTPUT_PARENTS[_JOINTS]
_SIDES = ("left", "right")


def _turns(closed: NDArray[np.float64]) -> NDArray[np.float64]:
    """Rotations of the finger joints in their parents, shape (3, 10, 3, 3), of hands closed so far, shape (2,)."""
    angle = (np.repeat(closed, len(FINGERS)) * _FIST_RAD)[..., None, None]
    return np.eye(3) + np.sin(angle) * _CROSS + (1.0 - np.cos(angle)) * _CROSS_TWICE


class Hands:
    """Closes the fingers by the hand states of one method (`circles` or `shape`)."""

    def __init__(self, method: str) -> None:
        self._method = method
        self._closed = np.full(2, RELAXED)
        self._turns = _turns(self._closed)

    def apply(self, rotations: NDArray[np.float64], seen: tuple[HandSeen, ...], dt: float) -> None:
        """Set the fingers' world rotations, in place, in `rotations`, shape (52, 3, 3).

        A hand's state is the mean over cameras, each as sure as it is far from 0.5. Where none is sure, the
        thesis's method keeps the last state and the other one slowly relaxes.
        """
        wanted = np.array([self._wanted(side, seen) for side in _SIDES])
        unknown = np.isnan(wanted)
        wanted[unknown] = RELAXED if self._method == "shape" else self._closed[unknown]
        if (wanted != self._closed).any():
            step = (1.0 - np.exp(-dt / np.where(unknown, RELAX_S, CLOSE_S))) * (wanted - self._closed)
            self._closed += np.clip(step, -FASTEST_PER_S * dt, FASTEST_PER_S * dt)
            self._turns = _turns(self._closed)
        for joints, parents, turn in zip(_JOINTS, _PARENTS, self._turns, strict=True):
            rotations[joints] = rotations.take(parents, axis=0) @ turn

    def _wanted(self, side: str, seen: tuple[HandSeen, ...]) -> float:
        """How far the hand should be closed, 0..1; NaN = unknown."""
        if not seen:
            return float("nan")
        states = np.array([h.open_probability for h in seen if h.side == side and h.method == self._method])
        sure = np.abs(states - 0.5)
        if sure.sum() <= 0.05:
            return float("nan")
        return 1.0 - float(states @ sure / sure.sum())
