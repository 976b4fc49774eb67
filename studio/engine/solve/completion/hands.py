"""Hands: the cameras' hand states, fused, open and close the fingers."""

import math

import numpy as np
from numpy.typing import NDArray

from studio.engine.base.compiled import compiled
from studio.engine.model.frames import HandSeen
from studio.engine.model.human.humanoid import COUPLINGS
from studio.engine.model.human.ranges import Dof, dofs_of, range_rad
from studio.engine.model.joints import FINGERS, OUTPUT_INDEX, OUTPUT_PARENTS

CLOSE_S = 0.12
"""Time constant of the fingers' closing and opening [s]."""

FASTEST_PER_S = 6.0
"""Largest rate of closing or opening [1/s]: a sixth of a second from flat to a fist."""

RELAXED = 0.25
"""Closure of a hand at rest, 0..1."""

RELAX_S = 2.0
"""Time constant with which a hand of unknown state relaxes [s]."""

# Bend of a finger's joints in a fist [deg], just within their ranges. `COUPLINGS` gives the last joint's bend from
# the middle joint's. The thumb lies over the index finger.
_FIST_DEG = (80.0, 95.0)
_FIST_THUMB_DEG = (15.0, 45.0, 60.0)


def _bend(name: str) -> Dof:
    return next(dof for dof in dofs_of(name) if dof.name == "bend")


def _fist_rad(name: str, flexibility: float) -> float:
    """Bend of a finger joint in the tightest fist within its range [rad]."""
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
        """Rotations of the finger joints in their parents, shape (3, 10, 3, 3), at the present closure."""
        return _finger_turns(self._closed, self._fist_rad, _CROSS, _CROSS_TWICE)

    def apply(self, rotations: NDArray[np.float64], seen: tuple[HandSeen, ...], dt: float) -> None:
        """Set the fingers' world rotations, in place, in `rotations`, shape (52, 3, 3).

        A hand's state is the mean over cameras, each weighted by its distance from 0.5. Without any certain camera,
        method `circles` (the thesis's) keeps the last state and `shape` relaxes slowly.
        """
        self.follow(seen, dt)
        _turn_fingers(rotations, _JOINTS, _PARENTS, self._turns)

    def follow(self, seen: tuple[HandSeen, ...], dt: float) -> None:
        """Open and close the hands by the states of the next frame; see `apply`."""
        wanted = np.array([self._wanted(side, seen) for side in _SIDES])
        unknown = np.isnan(wanted)
        wanted[unknown] = RELAXED if self._method == "shape" else self._closed[unknown]
        if (wanted != self._closed).any():
            step = (1.0 - np.exp(-dt / np.where(unknown, RELAX_S, CLOSE_S))) * (wanted - self._closed)
            self._closed += np.clip(step, -FASTEST_PER_S * dt, FASTEST_PER_S * dt)
            self._turns = self._turned()

    def bends_rad(self, side: int) -> NDArray[np.float64]:
        """Return the present bends of one hand's finger joints [rad], left (0) or right (1), shape (3, 5)."""
        own = slice(side * len(FINGERS), (side + 1) * len(FINGERS))
        return self._closed[side] * self._fist_rad[:, own]

    def _wanted(self, side: str, seen: tuple[HandSeen, ...]) -> float:
        """Measured closure of the hand, 0..1; NaN = unknown."""
        if not seen:
            return float("nan")
        total, closed = 0.0, 0.0
        for hand in seen:
            if hand.side == side and hand.method == self._method:
                sure = abs(hand.open_probability - 0.5)
                total += sure
                closed += sure * (1.0 - hand.open_probability)
        return closed / total if total > 0.05 else float("nan")


@compiled
def _finger_turns(
    closed: NDArray[np.float64],
    fist_rad: NDArray[np.float64],
    cross: NDArray[np.float64],
    cross_twice: NDArray[np.float64],
) -> NDArray[np.float64]:
    """Rotations about the fingers' axes, shape (3, 10, 3, 3), by Rodrigues' formula; the columns are left, then
    right."""
    out = np.empty(cross.shape)
    for row in range(fist_rad.shape[0]):
        for n in range(fist_rad.shape[1]):
            angle = closed[n * len(closed) // fist_rad.shape[1]] * fist_rad[row, n]
            sine, rest = math.sin(angle), 1.0 - math.cos(angle)
            for a in range(3):
                for b in range(3):
                    out[row, n, a, b] = sine * cross[row, n, a, b] + rest * cross_twice[row, n, a, b]
                out[row, n, a, a] += 1.0
    return out


@compiled
def _turn_fingers(
    rotations: NDArray[np.float64],
    joints: NDArray[np.int64],
    parents: NDArray[np.int64],
    turns: NDArray[np.float64],
) -> None:
    """Set finger joints' world rotations, in place, from the knuckles outward.

    Args:
        rotations: of all output joints, shape (52, 3, 3).
        joints: output joints by row, shape (3, 10).
        parents: of these joints, shape (3, 10).
        turns: rotations in the parents, shape (3, 10, 3, 3).
    """
    for row in range(3):
        for n in range(joints.shape[1]):
            joint, parent = joints[row, n], parents[row, n]
            for a in range(3):
                for b in range(3):
                    total = 0.0
                    for c in range(3):
                        total += rotations[parent, a, c] * turns[row, n, c, b]
                    rotations[joint, a, b] = total
