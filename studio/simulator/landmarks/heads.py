"""True heads of simulated performers, which glance about, and a pose network's errors on faces.

Sizes are those of BlazePose (full) on `rgb/pose2sim_single`, from its landmarks triangulated by four cameras:
- its faces are smaller than true ones. The landmarks of a face share an error of 1 to 2 cm; their own errors are 3 to
  5 mm, and 1 cm for an ear;
- it reports a face hidden by the skull with the same confidence, about where the body suggests it.

Solvers know none of this.
"""

import numpy as np
from numpy.typing import NDArray

from studio.engine.base.geometry import cross, unit
from studio.engine.model.joints import JOINT_SETS
from studio.simulator.joints.bone_frames import chest_axes
from studio.simulator.performer.acting import head_turns

Array = NDArray[np.float64]

FACE = slice(0, JOINT_SETS["mediapipe"].index("left_shoulder"))
"""The landmarks of the face, which come first."""

STREAM = 0x4644
"""Key of the heads' own random numbers, so that those of bodies and hands do not change."""

_ROUND_S, _RATE_HZ = 60.0, 60.0
"""Period [s] and sampling rate of the glances."""

_SIZE, _VARIES = (0.65, 1.0), 0.07
_UPRIGHT = 0.5
"""Share of the trunk's lean that the head compensates."""

_COMMON_M = (0.010, 0.009)
_COMMON_AR = (0.9835, 0.5)
"""Lasting and frame-to-frame error of a whole face: SD [m] and AR(1) coefficient; see `tracker`."""

_HIDDEN_COSINE = -0.25
"""Cosine of a landmark's direction to the camera's, from the skull's middle, below which the skull hides it."""


class SimulatedHead:
    """The head of one performer.

    Args:
        seed: of glances and proportions.

    Attributes:
        seen_size: size of the face as a network sees it: share of its true breadth, depth and height, shape (3,).
    """

    def __init__(self, seed: int) -> None:
        rng = np.random.default_rng([seed, STREAM])
        self.seen_size = rng.uniform(*_SIZE) * rng.normal(1.0, _VARIES, 3)
        self._glances = head_turns(np.arange(0.0, _ROUND_S, 1.0 / _RATE_HZ), rng)

    def straight(self, joints_m: Array) -> Array:
        """Return the rotation of a head that looks straight ahead, from the T-pose, 3x3.

        Args:
            joints_m: true joint centres, shape (21, 3).
        """
        chest: Array = chest_axes(joints_m[None])[0]
        upright: Array = (1.0 - _UPRIGHT) * chest[:, 2] + _UPRIGHT * np.array([0.0, 0.0, 1.0])
        up = unit(upright)
        back = unit(cross(up, chest[:, 0]))
        return np.column_stack([cross(back, up), back, up])

    def rotation(self, joints_m: Array, time_s: float) -> Array:
        """Return the head's rotation from the T-pose, in which it faces -y, at a time, 3x3."""
        return self.straight(joints_m) @ self.glance(time_s)

    def glance(self, time_s: float) -> Array:
        """Return the glance at a time, a rotation from looking straight ahead, 3x3."""
        turn: Array = self._glances[round(time_s * _RATE_HZ) % len(self._glances)]
        return turn


class FaceErrors:
    """One camera's errors of a whole face. It is stateful: frames must be given in order, at about 30 Hz.

    Args:
        seed, camera: the stage's seed and the camera's number, which seed the noise.
    """

    def __init__(self, *, seed: int, camera: int) -> None:
        self._rng = np.random.default_rng([seed, STREAM, 1 + camera])
        self._states = self._rng.normal(size=(2, 3))

    def next_m(self) -> Array:
        """Return the shift of the whole face in the next frame [m], shape (3,)."""
        for state, kept in zip(self._states, _COMMON_AR, strict=True):
            state[:] = kept * state + np.sqrt(1.0 - kept**2) * self._rng.normal(size=3)
        return np.array(_COMMON_M) @ self._states


def hidden_by_skull(places: Array, head: Array, to_eye: Array) -> NDArray[np.bool_]:
    """Return which landmarks the skull hides from a camera, shape (n,).

    Args:
        places: landmarks in the head's axes, shape (n, 3).
        head: its rotation, 3x3.
        to_eye: vector from the head to the camera, shape (3,).
    """
    return unit(places) @ (head.T @ unit(to_eye)) < _HIDDEN_COSINE
