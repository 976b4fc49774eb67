"""Decides where the corrected motion is kept: where its figures, which need no truth, are better."""

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import binary_closing, binary_opening, distance_transform_edt, gaussian_filter1d

from studio.engine.solve.uncertainty import BALL_90, OFFSET_M
from studio.engine.whole_take.physics.forces import ARM_M
from studio.engine.whole_take.physics.measure import PhysicsFigures

STRETCH_S = 0.15
"""Figures are compared as means over about this time before and after a frame."""

MIN_STRETCH_S = 0.3
EASE_S = 0.25
"""Shortest stretch of one motion, and blend time between the motions."""

SLIDE_M_S = 0.002
SUNK_M = 0.001
"""Rises of the means of sliding and sinking that count as equal."""

SINKS_M = 0.004
"""A sole that sinks deeper by this much in a single frame counts as straying."""

STRAY_SHARE = 0.5
"""A joint that is already outside its ball may move further out by this share of its deviation."""


def strays(
    before: NDArray[np.float64],
    after: NDArray[np.float64],
    measured: NDArray[np.float64],
    sigma: NDArray[np.float64],
) -> NDArray[np.bool_]:
    """Return the frames in which a joint has moved further from its measurement than the uncertainty allows.

    Args:
        before: joints of the finished motion [m], shape (F, 21, 3).
        after: of the corrected one.
        measured: the fused joints, same shape; NaN = unseen, without a limit.
        sigma: their deviation per axis [m], shape (F, 21).
    """
    deviation = np.hypot(sigma, OFFSET_M)
    was, is_ = (np.linalg.norm(joints - measured, axis=2) for joints in (before, after))
    return (is_ > np.maximum(BALL_90 * deviation, was + STRAY_SHARE * deviation)).any(
        axis=1
    )  # NaN compares as False


def kept(
    before: PhysicsFigures, after: PhysicsFigures, strayed: NDArray[np.bool_], dt: float
) -> NDArray[np.float64]:
    """Return the share of the corrected motion in each frame, 0..1, shape (F,).

    Args:
        before: figures of the finished motion, over a piece of a take without a gap.
        after: of the corrected one.
        strayed: frames that `strays` found.
        dt: time between frames [s].
    """

    def smooth(values: NDArray[np.float64]) -> NDArray[np.float64]:
        return gaussian_filter1d(values, STRETCH_S / dt, mode="nearest")

    def unexplained(figures: PhysicsFigures) -> NDArray[np.float64]:
        return smooth(figures.force_n + (figures.moment_nm + figures.excess_nm) / ARM_M)

    strayed = strayed | (after.sunk_m > before.sunk_m + SINKS_M)
    better = unexplained(after) < unexplained(before)
    better &= smooth(after.slide_m_s) <= smooth(before.slide_m_s) + SLIDE_M_S
    better &= smooth(after.sunk_m) <= smooth(before.sunk_m) + SUNK_M
    better = _without_short_runs(better & ~strayed, strayed, max(1, round(MIN_STRETCH_S / dt)))
    if better.all():
        return np.ones(len(better))
    away = np.clip(distance_transform_edt(better) * dt / EASE_S, 0.0, 1.0)
    return away * away * (3.0 - 2.0 * away)


def _without_short_runs(
    better: NDArray[np.bool_], strayed: NDArray[np.bool_], least: int
) -> NDArray[np.bool_]:
    """Flags with short gaps closed, except where joints stray, and then without runs of fewer than `least` frames."""
    size = np.ones(least, dtype=bool)
    closed = binary_closing(np.pad(better, least, mode="edge"), size) & ~np.pad(strayed, least, mode="edge")
    return binary_opening(closed, size)[least:-least]
