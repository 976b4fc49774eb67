"""A motion in which one performer repeatedly lifts another's arm by the wrist."""

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from studio.engine.animation.motion.keys import RATE_HZ
from studio.engine.base.geometry import unit
from studio.engine.model.joints import INDEX

_PERIOD_S = 4.0
_LOW_RAD, _HIGH_RAD = 0.5, 2.5
"""Range of the lifted arm's angle from straight down."""

_REACH = 0.95
"""Distance from shoulder to hand of the lifted arm, as a share of the arm's length."""

_GRIP_M = 0.04
"""Distance of the lifting hand's middle from the lifted wrist."""

_Array = NDArray[np.float64]


def with_lifted_arm(lifting: _Array, lifted: _Array) -> tuple[_Array, _Array]:
    """Return the motions of two performers side by side, the first one's left hand at the other's right wrist.

    Args:
        lifting, lifted: joints [m] at 120 Hz, shape (frame_count, 21, 3) each.
    """
    times = np.arange(len(lifted)) / RATE_HZ
    angle = _LOW_RAD + (_HIGH_RAD - _LOW_RAD) * (1.0 - np.cos(2 * np.pi * times / _PERIOD_S)) / 2.0
    shoulder = lifted[:, INDEX["right_shoulder"]]
    aside = unit((lifting[:, INDEX["left_shoulder"]] - shoulder) * [1.0, 1.0, 0.0])
    way = np.sin(angle)[:, None] * aside - np.cos(angle)[:, None] * [0.0, 0.0, 1.0]
    length = _lengths(lifted, "right").sum(axis=0)
    lifted = _reaching(lifted, "right", shoulder + _REACH * length[:, None] * way)
    wrist = lifted[:, INDEX["right_wrist"]]
    grip = wrist - _GRIP_M * unit(wrist - lifting[:, INDEX["left_shoulder"]])
    return _reaching(lifting, "left", grip), lifted


def _lengths(joints: _Array, side: str) -> _Array:
    """Return the lengths of upper arm, forearm and hand [m], shape (3, frame_count)."""
    arm = [joints[:, INDEX[f"{side}_{name}"]] for name in ("shoulder", "elbow", "wrist", "hand")]
    return np.array([np.linalg.norm(end - start, axis=1) for start, end in pairwise(arm)])


def _reaching(joints: _Array, side: str, target: _Array) -> _Array:
    """Return the joints with one hand at the target, as far as the arm reaches; the elbow hangs."""
    upper, fore, hand = _lengths(joints, side)
    below = fore + hand
    start = joints[:, INDEX[f"{side}_shoulder"]]
    apart = target - start
    far = np.clip(np.linalg.norm(apart, axis=1), np.abs(upper - below) + 1e-3, upper + below - 1e-3)
    way = unit(apart)
    down = np.array([0.0, 0.0, -1.0]) + 1e-3 * np.array([1.0, 0.0, 0.0])  # tilted, for arms that hang down
    across = unit(down - (way @ down)[:, None] * way)
    along = (upper**2 - below**2 + far**2) / (2.0 * far)
    out = joints.copy()
    elbow = start + along[:, None] * way + np.sqrt(np.maximum(upper**2 - along**2, 0.0))[:, None] * across
    end = start + far[:, None] * way
    out[:, INDEX[f"{side}_elbow"]] = elbow
    out[:, INDEX[f"{side}_wrist"]] = elbow + (fore / below)[:, None] * (end - elbow)
    out[:, INDEX[f"{side}_hand"]] = end
    return out
