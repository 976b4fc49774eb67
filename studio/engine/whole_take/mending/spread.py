"""The path of a joint through its pins, while it is otherwise unknown, or some cameras are wrong.

The joint moves smoothly and goes through the pins. Each camera's error is unknown, but mostly zero, and it changes
rarely and then at once.

Minimises the squared residuals of the cameras less their errors, the path's velocities and accelerations, the
logarithm of the errors, and the logarithm of their changes, by iteratively reweighted least squares whose logarithms
narrow from step to step. Frames couple with the next two only, so every step is a banded solve.

Source: sparse changes by a logarithmic penalty and reweighting: Candes, Wakin, Boyd, "Enhancing sparsity by
reweighted l1 minimization", J. Fourier Analysis and Applications 14, 2008; graduated narrowing: Blake, Zisserman,
"Visual reconstruction", 1987, chapter 7.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_solve_banded, cholesky_banded
from scipy.ndimage import gaussian_filter1d

from studio.engine.whole_take.mending.around import STEP_S
from studio.engine.whole_take.mending.middle import path_of

Array = NDArray[np.float64]

NOISE_M = 0.03
"""Standard deviation of a camera's elbow, increased because similar frames add little."""

PLACE_M = 0.003
"""Standard deviation of a pin."""

ACCELERATION_RANGE_M_S2 = (8.0, 40.0)
LIVELY, LIVELY_STEPS = 60.0, 1.5
SHARP = 6.0
"""Standard deviation of the path's accelerations: this percentile of those of the cameras' joint, smoothed over this
many instants, within this range; and the number of deviations from which an acceleration counts less.
"""

SPEED_RANGE_M_S = (0.3, 3.0)
ALIKE_FRAMES = 5.0
"""Standard deviation of the path's velocity: the same percentile, within this range; and the number of frames over
which it hardly changes. It keeps the path from swinging out where nothing is seen for a while.
"""

ERROR_COST, ERROR_M = 0.1, 0.04
"""Cost of an error in a frame, and the size of the error from which the cost hardly grows."""

CHANGE_COST, CHANGE_M = 1.0, 0.01
"""Cost of a change of the error from one frame to the next, and the size from which the cost hardly grows."""

WIDTHS = (3.0, 3.0, 2.0, 2.0, 1.4, 1.4, 1.0, 1.0)
"""Factors by which the logarithms are wider in each step."""


@dataclass(frozen=True)
class Spread:
    """The most likely path of a joint, and the cameras' errors.

    Attributes:
        path_m: shape (frame_count, 3) [m].
        error_m: shape (frame_count, camera_count, 3) [m]; interpolated where a camera sees nothing.
    """

    path_m: Array
    error_m: Array


def spread(
    seen_m: Array,
    pinned: NDArray[np.bool_],
    place_m: Array,
    sigma: Array,
) -> Spread:
    """Return the most likely path and errors.

    Args:
        seen_m: each camera's joint at instants `around.STEP_S` apart, in axes in which it moves little [m], shape
            (frame_count, camera_count, 3); NaN = unseen.
        pinned: instants with a pin, shape (frame_count,).
        place_m: its places in the same axes [m], shape (frame_count, 3).
        sigma: standard deviation of each camera's joint relative to that of an elbow, shape (frame_count,
            camera_count).
    """
    frames = len(seen_m)
    seen = np.isfinite(seen_m[..., 0])
    told = seen / (NOISE_M * sigma) ** 2
    measured = np.where(seen[..., None], seen_m, 0.0)
    error = np.zeros_like(measured)
    path = np.zeros((frames, 3))
    speed, usual = _usual(seen_m)
    acceleration = np.full(max(frames - 2, 0), usual**-2)
    slow = (speed * STEP_S) ** -2 / ALIKE_FRAMES
    for width in WIDTHS:
        wide, wide_change = ERROR_M * width, CHANGE_M * width
        size, change = (error**2).sum(axis=2), (np.diff(error, axis=0) ** 2).sum(axis=2)
        of_error = ERROR_COST / (wide**2 + size)
        of_change = CHANGE_COST / (wide_change**2 + change)
        path, error = _solved(measured, told, pinned, place_m, (slow, acceleration), of_error, of_change)
        bend = np.diff(path, n=2, axis=0) / STEP_S**2
        squared = (bend**2).sum(axis=1) / usual**2
        acceleration = usual**-2 / (1.0 + squared / SHARP**2)
    return Spread(path, error)


def _usual(seen_m: Array) -> tuple[float, float]:
    """Standard deviations of the joint's velocity [m/s] and acceleration [m/s2]."""
    path = path_of(seen_m)
    smooth = gaussian_filter1d(path, LIVELY_STEPS, axis=0, mode="nearest")
    usual = [
        np.percentile(np.linalg.norm(np.diff(smooth, n=n, axis=0), axis=1), LIVELY) / STEP_S**n
        if len(path) > n
        else 1.0
        for n in (1, 2)
    ]
    return float(np.clip(usual[0], *SPEED_RANGE_M_S)), float(np.clip(usual[1], *ACCELERATION_RANGE_M_S2))


def _solved(
    measured: Array,
    told: Array,
    pinned: NDArray[np.bool_],
    place_m: Array,
    smooth: tuple[float, Array],
    of_error: Array,
    of_change: Array,
) -> tuple[Array, Array]:
    """The least-squares solution with these weights, `smooth` those of the path's steps [1/m2] and accelerations
    [s4/m2]; the unknowns of a frame are the path, then each camera's error."""
    frames, cameras = told.shape
    width = cameras + 1
    band = np.zeros(
        (2 * width + 1, frames * width)
    )  # lower form: band[k, i] is the entry of row i + k, column i
    right = np.zeros((frames * width, 3))
    own = np.arange(frames) * width
    pin = pinned / PLACE_M**2
    band[0, own] += told.sum(axis=1) + pin + 1e-6
    right[own] += np.einsum("tc,tca->ta", told, measured) + pin[:, None] * place_m
    for c in range(cameras):
        mine = own + 1 + c
        band[0, mine] += told[:, c] + of_error[:, c] + 1e-6
        band[1 + c, own] += told[:, c]
        right[mine] += told[:, c, None] * measured[:, c]
        band[0, mine[:-1]] += of_change[:, c]
        band[0, mine[1:]] += of_change[:, c]
        band[width, mine[:-1]] -= of_change[:, c]
    _add_smooth(band, own, *smooth)
    factor = cholesky_banded(band, overwrite_ab=True, lower=True, check_finite=False)
    found = cho_solve_banded((factor, True), right, check_finite=False).reshape(frames, width, 3)
    return found[:, 0], found[:, 1:]


def _add_smooth(band: Array, own: NDArray[np.int64], slow: float, acceleration: Array) -> None:
    """Add the rows of a path's steps [1/m2] and accelerations [s4/m2] to a band in lower form; `own`: its columns."""
    width, stiff = int(own[1] - own[0]) if len(own) > 1 else 1, acceleration / STEP_S**4
    band[0, own[:-1]] += slow
    band[0, own[1:]] += slow
    band[width, own[:-1]] -= slow
    for rows, factor in ((own[:-2], 1.0), (own[1:-1], 4.0), (own[2:], 1.0)):
        band[0, rows] += factor * stiff
    band[width, own[:-2]] -= 2.0 * stiff
    band[width, own[1:-1]] -= 2.0 * stiff
    band[2 * width, own[:-2]] += stiff
