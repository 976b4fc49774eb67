"""Prediction of the end of a limb while it is unknown, from the rest of the limb, learnt at other times.

It uses axes that turn with the bone before it: a straight leg stays straight. The place of the end relative to its
parent is a sum. One part is a smooth function of the rest of the limb (place and velocity of the parent relative to
the root of the limb, and the height of the root). The other is a small remainder that changes smoothly in time. Both
are found from the instants at which the end is known, from the pins, and from the limb of the other side, which has a
remainder of its own.

Source: Gaussian process regression with a sum of covariances (Rasmussen, Williams, "Gaussian processes for machine
learning", 2006, 2.2 and 4.2.4).
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter1d, maximum_filter1d
from scipy.spatial.distance import cdist

from studio.engine.model.joints import CANONICAL, LIMB_ROOTS, MIRROR, PARENTS
from studio.engine.whole_take.mending.around import STEP_S

Array = NDArray[np.float64]

NOISE_M, PIN_M = 0.06, 0.005
"""Standard deviations [m] of an end as cameras see it, including what neither part explains; and of a pin."""

OF_LIMB = 0.97
"""Share of the end's variance that the rest of its limb explains; the remainder has the rest."""

LIKE_M, LIKE_M_S = 0.5, 5.0
"""Length scales of the likeness of limbs: differences of their parents' places [m] and velocities [m/s]."""

LASTS_S = 0.5
"""Time scale of the remainder."""

BESIDE = 2
"""Instants next to unknown ones that do not count, because they may be partly wrong."""

OTHER_SIDE_EVERY = 2
"""Interval between the instants of the other side that are used."""

SMOOTH_FRAMES = 1.5
"""Smoothing of the parent's path."""

_REST_OF_ARM, _REST_OF_LEG = (0.5, -0.5, -0.7), (0.1, -0.4, -0.9)
"""Usual direction of a left upper arm or thigh: to the left, back and up."""

OPPOSITE = 0.05
"""Least denominator of the axes' turn, which would grow without limit for a bone in the opposite direction."""

_MIRRORED = np.array([-1.0, 1.0, 1.0])
_MIRRORED_LIMB = np.array([*_MIRRORED, *_MIRRORED, 1.0])


@dataclass(frozen=True)
class Habit:
    """Predicted place of a joint relative to its parent.

    Attributes:
        axes: axes of the prediction, shape (count, 3, 3).
        path_m: the place in these axes [m], shape (count, 3); 0 where the joint is never known.
    """

    axes: Array
    path_m: Array


def habit(
    middle: Array, away: Array, pinned: NDArray[np.bool_], pin_away: Array, joint: int, axes: Array
) -> Habit:
    """Return the place of a joint relative to its parent, predicted from the rest of its limb.

    Args:
        middle: all joints, without gaps [m], shape (count, 21, 3).
        away: the joint relative to its parent, median of the cameras [m], shape (count, 3); NaN = unknown.
        pinned: instants with a pin, shape (count,).
        pin_away: the pin relative to the parent [m], shape (count, 3).
        joint: index of the joint.
        axes: of the body, shape (count, 3, 3).
    """
    other, count = int(MIRROR[joint]), len(middle)
    own, beside = (axes_of_bone(middle, one, axes) for one in (joint, other))
    unknown = maximum_filter1d(np.isnan(away[:, 0]), 2 * BESIDE + 1, mode="nearest")
    if (unknown | pinned).all():
        return Habit(own, np.zeros_like(away))
    told, others = np.flatnonzero(~unknown | pinned), np.arange(0, count, OTHER_SIDE_EVERY)
    limb, mirrored = _limb(middle, joint, axes), _limb(middle, other, axes) * _MIRRORED_LIMB
    end = np.einsum("tba,tb->ta", own, np.where(pinned[:, None], pin_away, away))[told]
    beyond = np.einsum("tba,tb->ta", beside, middle[:, other] - middle[:, PARENTS[other]]) * _MIRRORED
    of_limb, places = np.concatenate([limb[told], mirrored[others]]), np.concatenate([end, beyond[others]])
    instants, of_own = np.concatenate([told, others]), np.arange(len(places)) < len(told)
    usual = end.mean(axis=0)
    size = float(((end - usual) ** 2).mean())
    noise = np.full(len(places), NOISE_M**2)
    noise[: len(told)][pinned[told]] = PIN_M**2

    def alike(limbs: Array, at: NDArray[np.int64], is_own: NDArray[np.bool_]) -> Array:
        lasts = _lasts(at[:, None] - instants) * (is_own[:, None] == of_own)
        return size * (OF_LIMB * _alike(limbs, of_limb) + (1.0 - OF_LIMB) * lasts)

    weights = np.linalg.solve(alike(of_limb, instants, of_own) + np.diag(noise), places - usual)
    every = np.arange(count)
    return Habit(own, usual + alike(limb, every, np.ones(count, dtype=bool)) @ weights)


def axes_of_bone(middle: Array, joint: int, axes: Array) -> Array:
    """Return axes that turn with the bone before a joint's own, without twist about it, shape (count, 3, 3).

    Args:
        middle, joint, axes: as in `habit`. A joint next to the limb's root has the trunk instead of this bone.
    """
    parent = int(PARENTS[joint])
    if parent == int(LIMB_ROOTS[joint]):
        return axes
    bone = middle[:, parent] - middle[:, PARENTS[parent]]
    bone = np.einsum("tba,tb->ta", axes, gaussian_filter1d(bone, SMOOTH_FRAMES, axis=0, mode="nearest"))
    bone /= np.maximum(np.linalg.norm(bone, axis=1, keepdims=True), 1e-6)
    side, _, part = CANONICAL[joint].partition("_")
    rest = np.array(_REST_OF_ARM if part in ("wrist", "hand") else _REST_OF_LEG)
    rest = rest * [1.0 if side == "left" else -1.0, 1.0, 1.0] / np.linalg.norm(rest)
    turn = np.cross(rest, bone)
    across = np.zeros((len(bone), 3, 3))
    for a, b, c in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        across[:, b, a], across[:, a, b] = turn[:, c], -turn[:, c]
    share = 1.0 / np.maximum(1.0 + bone @ rest, OPPOSITE)
    return axes @ (np.eye(3) + across + share[:, None, None] * across @ across)


def _limb(middle: Array, joint: int, axes: Array) -> Array:
    """Features of the limb of a joint, in units of `LIKE_M` and `LIKE_M_S`, shape (count, 7)."""
    root = middle[:, int(LIMB_ROOTS[joint])]
    parent = np.einsum("tba,tb->ta", axes, middle[:, PARENTS[joint]] - root)
    parent = gaussian_filter1d(parent, SMOOTH_FRAMES, axis=0, mode="nearest")
    velocity = np.gradient(parent, STEP_S, axis=0)
    return np.concatenate([parent / LIKE_M, velocity / LIKE_M_S, root[:, 2:] / LIKE_M], axis=1)


def _alike(a: Array, b: Array) -> Array:
    """Likeness of limbs' features, 0..1, shape (count of a, count of b)."""
    return np.exp(-0.5 * cdist(a, b, "sqeuclidean"))


def _lasts(apart: NDArray[np.int64]) -> Array:
    """Correlation of the remainder, 0..1, at these distances [instants]: a Matern covariance of 5/2."""
    r = np.sqrt(5.0) * np.abs(apart) * STEP_S / LASTS_S
    return (1.0 + r + r**2 / 3.0) * np.exp(-r)
