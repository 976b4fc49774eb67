"""Hands: the cameras' hand states, fused, open and close the fingers."""

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from studio.engine.frames import HandSeen
from studio.engine.joints import FINGERS, OUTPUT_INDEX, OUTPUT_PARENTS

CLOSE_S = 0.12
"""Time constant with which the fingers follow the hand's state [s]."""

RELAXED = 0.25
"""How far the fingers of a hand of unknown state are closed, 0..1."""

# Bend of the three joints of a finger in a fist [deg]: Norkin & White 2016, ends of flexion.
_FIST_DEG = (80.0, 95.0, 60.0)
_FIST_THUMB_DEG = (25.0, 40.0, 50.0)


def _bends(side: str) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Finger joints of a hand, parents first, and their bend in a fist as rotation vectors [rad]."""
    x = 1.0 if side == "Left" else -1.0
    joints, vectors = [], []
    for finger in FINGERS:
        angles = _FIST_THUMB_DEG if finger == "Thumb" else _FIST_DEG
        axis = np.array([-0.35, x * 0.35, -x * 0.85]) if finger == "Thumb" else np.array([0.0, x, 0.0])
        for k, angle in enumerate(angles, start=1):
            joints.append(OUTPUT_INDEX[f"{side}Hand{finger}{k}"])
            vectors.append(np.radians(angle) * axis / np.linalg.norm(axis))
    return np.array(joints), np.array(vectors)


class Hands:
    """Closes the fingers by the hand states of one method (`circles` or `shape`)."""

    def __init__(self, method: str) -> None:
        self._method = method
        self._closed = {"left": RELAXED, "right": RELAXED}
        self._bends = {side: _bends(side.capitalize()) for side in ("left", "right")}

    def apply(self, rotations: NDArray[np.float64], seen: tuple[HandSeen, ...], dt: float) -> None:
        """Set the fingers' world rotations, in place, in `rotations`, shape (52, 3, 3).

        A hand's state is the mean over cameras, each as sure as it is far from 0.5.
        """
        for side, (joints, vectors) in self._bends.items():
            states = np.array(
                [h.open_probability for h in seen if h.side == side and h.method == self._method]
            )
            wanted = RELAXED
            sure = np.abs(states - 0.5)
            if len(states) and sure.sum() > 0.05:
                wanted = 1.0 - float(states @ sure / sure.sum())
            self._closed[side] += (1.0 - np.exp(-dt / CLOSE_S)) * (wanted - self._closed[side])
            turns = Rotation.from_rotvec(self._closed[side] * vectors).as_matrix()
            for joint, turn in zip(joints, turns, strict=True):
                rotations[joint] = rotations[OUTPUT_PARENTS[joint]] @ turn
