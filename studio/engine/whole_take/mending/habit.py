"""Where the end of a limb usually is, by what the rest of the limb does: as at other times, and as on the other side.

The end's place about its parent is a smooth function of the parent's place and velocity about the limb's root, and of
the root's height. It is found from the instants at which the end is known, and from the other side's limb. Whether
that tells more than the places before and after is tried on other stretches of the same length.

Source: Gaussian process regression (Rasmussen, Williams, "Gaussian processes for machine learning", 2006, 2.2).
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter1d

from studio.engine.model.joints import LIMB_ROOTS, MIRROR, PARENTS
from studio.engine.whole_take.mending.around import STEP_S
from studio.engine.whole_take.mending.middle import median_of

Array = NDArray[np.float64]

NOISE_M = 0.03
"""Standard deviation of an end's place from what the rest of its limb tells."""

LIKE_M, LIKE_M_S = 0.1, 1.0
"""Limbs are alike whose parents' places [m] and velocities [m/s] differ by less."""

SMOOTH_FRAMES = 1.5
"""Smoothing of the parent's path."""

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


def usual_path(middle: Array, local: Array, joint: int, axes: Array) -> Array:
    """Return where a joint usually is about its parent, in the axes of the body [m], shape (count, 3); 0 where that
    tells nothing.

    Args:
        middle: all joints, without gaps [m], shape (count, 21, 3).
        local: the joint about its parent in these axes, as each camera has it where that is known, shape (count,
            camera_count, 3); else NaN.
        joint: index of the joint.
        axes: of the body, shape (count, 3, 3).
    """
    end, other = median_of(local[:, :, None])[:, 0], int(MIRROR[joint])
    away = middle[:, other] - middle[:, PARENTS[other]]
    limb = _limb(middle, joint, axes)
    beside = _Samples(
        _limb(middle, other, axes) * _MIRRORED_LIMB, np.einsum("tba,tb->ta", axes, away) * _MIRRORED
    )
    known = np.isfinite(end[:, 0])
    tried = _stretches(known)

    def path(way: str, told: NDArray[np.bool_]) -> Array:
        if way == "nothing" or not told.any():
            return np.zeros_like(end)
        own = _Samples(limb[told], end[told])
        if way == "both":
            own = _Samples(np.concatenate([own.limb, beside.limb]), np.concatenate([own.end_m, beside.end_m]))
        return own.foretold(limb)

    def error(way: str) -> float:
        found = []
        for first, last in tried:
            told = known.copy()
            told[first:last] = False
            off = end - path(way, told)
            share = (np.arange(first, last) - first + 1.0)[:, None] / (last - first + 1.0)
            between = (1.0 - share) * off[first - 1] + share * off[last]
            found.append(((off[first:last] - between) ** 2).sum(axis=1))
        return float(np.mean(np.concatenate(found))) if found else 0.0

    return path(min(("nothing", "own", "both"), key=error), known)


def _stretches(known: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """Stretches of known instants that are as long as what is unknown, half of that apart."""
    length = max(int((~known).sum()), 2)
    firsts = range(1, len(known) - length, max(length // 2, 1))
    return [(first, first + length) for first in firsts if known[first - 1 : first + length + 1].all()]


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
