"""Where the end of a limb usually is, by what the rest of the limb does: as at other times, and as on the other side.

It is told in the axes of the trunk, or in axes that turn with the bone before it: a leg that is straight stays
straight. The place of the end about its parent is a smooth function of the place and velocity of the parent about the
root of the limb, and of the height of the root. It is found from the instants at which the end is known, and from the
limb of the other side. Which of them tells most is tried on other stretches of the same length.

Source: Gaussian process regression (Rasmussen, Williams, "Gaussian processes for machine learning", 2006, 2.2).
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter1d

from studio.engine.model.joints import CANONICAL, LIMB_ROOTS, MIRROR, PARENTS
from studio.engine.whole_take.mending.around import STEP_S

Array = NDArray[np.float64]

NOISE_M = 0.03
"""Standard deviation of an end's place from what the rest of its limb tells."""

LIKE_M, LIKE_M_S = 0.1, 1.0
"""Limbs are alike whose parents' places [m] and velocities [m/s] differ by less."""

SMOOTH_FRAMES = 1.5
"""Smoothing of the parent's path."""

LEAST_APART = 8
"""Stretches on which ways are tried begin at least so many instants apart."""

_REST_OF_ARM, _REST_OF_LEG = (0.5, -0.5, -0.7), (0.1, -0.4, -0.9)
"""Where a left upper arm or thigh usually points, to the left, back and up."""

OPPOSITE = 0.05
"""A bone that points the opposite way turns axes no further."""

_MIRRORED = np.array([-1.0, 1.0, 1.0])
_MIRRORED_LIMB = np.array([*_MIRRORED, *_MIRRORED, 1.0])


@dataclass(frozen=True)
class _Samples:
    """What limbs do, shape (count, 7), and where their ends are then [m], shape (count, 3)."""

    limb: Array
    end_m: Array

    def foretold(self, limb: Array) -> Array:
        """Where an end is, for what its limb does [m], shape (count, 3)."""
        usual = self.end_m.mean(axis=0)
        size = float(((self.end_m - usual) ** 2).mean()) or 1.0
        normal = size * _alike(self.limb, self.limb) + NOISE_M**2 * np.eye(len(self.limb))
        weights = np.linalg.solve(normal, self.end_m - usual)
        return usual + size * _alike(limb, self.limb) @ weights


@dataclass(frozen=True)
class Habit:
    """Where a joint usually is about its parent.

    Attributes:
        axes: in which that is told, shape (count, 3, 3).
        path_m: in these axes [m], shape (count, 3); 0 where the rest of the limb tells nothing.
    """

    axes: Array
    path_m: Array


def habit(middle: Array, away: Array, pinned: NDArray[np.bool_], joint: int, axes: Array) -> Habit:
    """Return where a joint usually is about its parent.

    Args:
        middle: all joints, without gaps [m], shape (count, 21, 3).
        away: the joint about its parent where that is known, the median of the cameras, shape (count, 3); else NaN.
        pinned: instants with a pin, shape (count,).
        joint: index of the joint.
        axes: of the body, shape (count, 3, 3).
    """
    other = int(MIRROR[joint])
    beyond = middle[:, other] - middle[:, PARENTS[other]]
    limb, mirrored = _limb(middle, joint, axes), _limb(middle, other, axes) * _MIRRORED_LIMB
    known = np.isfinite(away[:, 0])
    tried = _stretches(known, pinned)
    found: list[tuple[float, Habit]] = []
    for own, beside in ((axes, axes), (axes_of_bone(middle, joint, axes), axes_of_bone(middle, other, axes))):
        end = np.einsum("tba,tb->ta", own, away)
        others = _Samples(mirrored, np.einsum("tba,tb->ta", beside, beyond) * _MIRRORED)
        for way in ("nothing", "own", "both"):

            def path(
                told: NDArray[np.bool_], end: Array = end, others: _Samples = others, way: str = way
            ) -> Array:
                if way == "nothing" or not told.any():
                    return np.zeros_like(end)
                mine = _Samples(limb[told], end[told])
                if way == "both":
                    mine = _Samples(
                        np.concatenate([mine.limb, others.limb]), np.concatenate([mine.end_m, others.end_m])
                    )
                return mine.foretold(limb)

            found.append((_error(end, known, tried, path), Habit(own, path(known))))
    return min(found, key=lambda one: one[0])[1]


def axes_of_bone(middle: Array, joint: int, axes: Array) -> Array:
    """Return axes that turn with the bone before a joint's own, and not about it, shape (count, 3, 3).

    Args:
        middle, joint, axes: as in `habit`. The bone of a joint next to the limb's root is the trunk.
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


def _error(
    end: Array,
    known: NDArray[np.bool_],
    tried: Sequence[tuple[int, int, int]],
    path: Callable[[NDArray[np.bool_]], Array],
) -> float:
    """Mean squared error of a path where it is taken for unknown: it is put through its ends, and the pin between
    [m2]."""
    found = []
    for first, pin, last in tried:
        told = known.copy()
        told[first:last] = False
        off = end - path(told)
        rows, knots = np.arange(first, last), [first - 1, pin, last]
        between = np.stack([np.interp(rows, knots, off[knots, axis]) for axis in range(3)], axis=1)
        found.append(((off[first:last] - between) ** 2).sum(axis=1))
    return float(np.mean(np.concatenate(found))) if found else 0.0


def _stretches(known: NDArray[np.bool_], pinned: NDArray[np.bool_]) -> list[tuple[int, int, int]]:
    """First and last instants of stretches that are known and as long as what is unknown, half of that apart, with
    where the pin would be."""
    unknown = np.flatnonzero(~known)
    length = max(len(unknown), 2)
    at = np.flatnonzero(pinned & ~known)
    share = 0.5 if not len(at) else (at.mean() - unknown[0]) / max(unknown[-1] - unknown[0], 1)
    firsts = range(1, len(known) - length, max(length // 2, LEAST_APART))
    pin = int(np.clip(round(share * (length - 1)), 0, length - 1))
    return [
        (first, first + pin, first + length)
        for first in firsts
        if known[first - 1 : first + length + 1].all()
    ]


def _limb(middle: Array, joint: int, axes: Array) -> Array:
    """What the limb of a joint does, in units of what is alike, shape (count, 7)."""
    root = middle[:, int(LIMB_ROOTS[joint])]
    parent = np.einsum("tba,tb->ta", axes, middle[:, PARENTS[joint]] - root)
    parent = gaussian_filter1d(parent, SMOOTH_FRAMES, axis=0, mode="nearest")
    velocity = np.gradient(parent, STEP_S, axis=0)
    return np.concatenate([parent / LIKE_M, velocity / LIKE_M_S, root[:, 2:] / LIKE_M], axis=1)


def _alike(a: Array, b: Array) -> Array:
    """How alike what limbs do is, 0..1, shape (count of a, count of b)."""
    return np.exp(-0.5 * ((a[:, None] - b) ** 2).sum(axis=2))
