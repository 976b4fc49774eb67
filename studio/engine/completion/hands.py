"""Hands: the cameras' hand states, fused, open and close the fingers."""

import math

import numpy as np
from numpy.typing import NDArray

from studio.engine.frames import HandSeen
from studio.engine.human.model import COUPLINGS
from studio.engine.human.ranges import Dof, dofs_of, range_rad
from studio.engine.joints import FINGERS, OUTPUT_INDEX, OUTPUT_PARENTS

CLOSE_S = 0.12
"""Time constant with which the fingers follow the hand's state [s]."""

FASTEST_PER_S = 6.0
"""Fingers close or open no faster than this [1/s]: from flat to a fist in a sixth of a second."""

RELAXED = 0.25
"""How far the fingers of a hand at rest are closed, 0..1."""

RELAX_S = 2.0
"""Time constant with which a hand of unknown state goes to rest [s]."""

# Bend of a finger's joints in a fist [deg], just within their ranges; the last joint follows the middle one as
# `COUPLINGS` has it. The thumb lies over the index finger.
_FIST_DEG = (80.0, 95.0)
_FIST_THUMB_DEG = (15.0, 45.0, 60.0)


def _bend(name: str) -> Dof:
    return next(dof for dof in dofs_of(name) if dof.name == "bend")


def _fist_rad(name: str, flexibility: float) -> float:
    """Bend of a finger joint in the tightest fist that its range allows [rad]."""
    thumb, k = "Thumb" in name, int(name[-1])
    if k == 3 and not thumb:
        return COUPLINGS[f"{name}_bend"][1] * _fist_rad(f"{name[:-1]}2", flexibility)
    wanted = math.radians((_FIST_THUMB_DEG if thumb else _FIST_DEG)[k - 1])
    return min(wanted, float(range_rad(_bend(name), flexibility)[1]))


def _cross(axis: tuple[float, float, float]) -> list[list[float]]:
    """Cross-product matrix of an axis's direction."""
    x, y, z = np.array(axis) / np.linalg.norm(axis)
    return [[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]]


_NAMES = tuple(
    f"{side}Hand{finger}{k}" for k in (1, 2, 3) for side in ("Left", "Right") for finger in FINGERS
)
"""Finger joints of both hands, from the knuckles outward, left then right: rows of (3, 10)."""

_JOINTS = np.reshape([OUTPUT_INDEX[name] for name in _NAMES], (3, 10))
_PARENTS = OUTPUT_PARENTS[_JOINTS]
_CROSS = np.reshape([_cross(_bend(name).axis) for name in _NAMES], (3, 10, 3, 3))
_CROSS_TWICE = _CROSS @ _CROSS
_SIDES = ("left", "right")


class Hands:
    """Closes the fingers by the hand states of one method (`circles` or `shape`)."""

    def __init__(self, method: str, *, flexibility: float = 1.0) -> None:
        self._method = method
        self._fist_rad = np.reshape([_fist_rad(name, flexibility) for name in _NAMES], (3, 10))
        self._closed = np.full(2, RELAXED)
        self._turns = self._turned()

    def _turned(self) -> NDArray[np.float64]:
        """Rotations of the finger joints in their parents, shape (3, 10, 3, 3), of hands closed as they are now."""
        angle = (np.repeat(self._closed, len(FINGERS)) * self._fist_rad)[..., None, None]
        return np.eye(3) + np.sin(angle) * _CROSS + (1.0 - np.cos(angle)) * _CROSS_TWICE

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
            self._turns = self._turned()
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
