"""First guess of the offset between two cameras' clocks, from the motion itself.

The speed of a joint does not depend on the camera that sees it, so the speeds that two cameras report are the
same curve, shifted by the clock offset. Normalised cross-correlation finds the best shift of every joint's curve.
`refine` then finds offset and drift together with the transforms.

Source: cross-correlation of motion signals as in Caspi and Irani, "Spatio-temporal alignment of sequences",
PAMI 2002, section 3; normalised as in Lewis, "Fast normalized cross-correlation", 1995.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from studio.engine.base.sentences import say
from studio.engine.calibration.cameras.pairs import GRID_HZ, Track, sample
from studio.engine.model.joints import MIRROR

WINDOW_S = 2.0
"""Largest offset searched for clocks that overlap."""
MIN_CORRELATION = 0.4
MIN_SPEED_M_S = 0.05
"""Smallest variation of the speeds with which a shift is found."""
_MAX_SPEED_M_S = 4.0
_HALF_STEP_S = 0.1
_SHORTEST_S = 3.0
_LONGEST_S = 600.0
"""Longest motion used. More adds no information, and a clock that jumped would make it endless."""


@dataclass(frozen=True)
class ClockShift:
    """A clock offset from the motion: reference time = device time + offset_s (both since the first frames).

    `found` is False where the motion is too slow or too different; `reason` then says why. `lively`: the motion is
    still fast enough for `refine` to find the clock.
    """

    offset_s: float
    correlation: float
    found: bool
    reason: str = ""
    lively: bool = False


def speeds(track: Track, hz: float = GRID_HZ) -> NDArray[np.float64]:
    """Return joint speeds [m/s] on a grid over the track, left and right added, shape (instant_count, 21)."""
    times = np.arange(0.0, track.times_s[-1], 1.0 / hz)
    later, _ = sample(track, times + _HALF_STEP_S)
    earlier, _ = sample(track, times - _HALF_STEP_S)
    speed = np.linalg.norm(later - earlier, axis=2) / (2 * _HALF_STEP_S)
    speed = np.minimum(speed, _MAX_SPEED_M_S)
    return (speed + speed[:, MIRROR]) / 2


def find_shift(track: Track, reference: Track, *, near_s: float | None) -> ClockShift:
    """Return the shift of the track's clock that matches the reference's motion.

    Args:
        track, reference: the two cameras; both at least 3 s long for a result.
        near_s: the offset around which to search (`WINDOW_S`); None searches every overlap of at least half
            of the shorter track.
    """
    if min(_seconds(track), _seconds(reference)) < _SHORTEST_S:
        return ClockShift(
            near_s or 0.0, 0.0, False, say("clock.too_short", "too short to compare the motion")
        )
    a, b = speeds(reference.until(_LONGEST_S)), speeds(track.until(_LONGEST_S))
    variation = float(
        np.nanmedian([np.nanstd(x[np.isfinite(x)]) for x in b.T if np.isfinite(x).sum() > 30] or [0])
    )
    lags, values = _correlations(a, b)
    if near_s is None:
        allowed = _overlap(len(a), len(b), lags) >= min(len(a), len(b)) / 2
    else:
        allowed = np.abs(lags / GRID_HZ - near_s) <= WINDOW_S
    allowed &= np.isfinite(values)
    if not allowed.any():
        return ClockShift(
            near_s or 0.0,
            0.0,
            False,
            say("clock.nothing_at_once", "the cameras saw nothing at the same time"),
        )
    best = int(np.flatnonzero(allowed)[np.argmax(values[allowed])])
    offset = (lags[best] + _peak(values, best)) / GRID_HZ
    if variation < MIN_SPEED_M_S:
        return ClockShift(
            near_s or 0.0,
            float(values[best]),
            False,
            say("clock.too_slow", "the motion is too slow to compare clocks"),
        )
    if values[best] < MIN_CORRELATION:
        reason = say("clock.motion_differs", "the motion does not match the reference's")
        return ClockShift(near_s or 0.0, float(values[best]), False, reason, lively=True)
    return ClockShift(float(offset), float(values[best]), True, lively=True)


def _seconds(track: Track) -> float:
    """Return an upper bound of the track's duration [s]."""
    return min(
        len(track.times_s) / GRID_HZ,
        float(track.until(_LONGEST_S).times_s[-1]) if len(track.times_s) else 0.0,
    )


def _overlap(count_a: int, count_b: int, lags: NDArray[np.int64]) -> NDArray[np.float64]:
    return np.minimum(count_a, count_b + lags) - np.maximum(0, lags)


def _correlations(
    a: NDArray[np.float64], b: NDArray[np.float64]
) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Return lags [grid steps] and the median over joints of the normalised correlation of a(i + lag), b(i)."""
    lags = np.arange(-(len(b) - 1), len(a))
    size = 1 << int(np.ceil(np.log2(len(a) + len(b))))

    def correlate(x: NDArray[np.float64], y: NDArray[np.float64]) -> NDArray[np.float64]:
        full = np.fft.irfft(
            np.fft.rfft(x, size, axis=0) * np.conj(np.fft.rfft(y, size, axis=0)), size, axis=0
        )
        return full[lags]

    seen_a, seen_b = np.isfinite(a), np.isfinite(b)
    usable = (seen_a.sum(axis=0) > GRID_HZ) & (seen_b.sum(axis=0) > GRID_HZ)
    if not usable.any():
        return lags, np.full(len(lags), np.nan)
    a, b, ma, mb = a[:, usable], b[:, usable], seen_a[:, usable], seen_b[:, usable]
    a = np.where(ma, a - np.nanmean(a, axis=0), 0.0)
    b = np.where(mb, b - np.nanmean(b, axis=0), 0.0)
    ma, mb = ma.astype(float), mb.astype(float)
    count = np.maximum(correlate(ma, mb), 1.0)
    sum_a, sum_b = correlate(a, mb), correlate(ma, b)
    covariance = correlate(a, b) - sum_a * sum_b / count
    variance = (correlate(a * a, mb) - sum_a**2 / count) * (correlate(ma, b * b) - sum_b**2 / count)
    values = covariance / np.sqrt(np.maximum(variance, 1e-9))
    values[count < GRID_HZ] = np.nan
    enough = np.isfinite(values).any(axis=1)
    out = np.full(len(lags), np.nan)
    out[enough] = np.nanmedian(values[enough], axis=1)
    return lags, out


def _peak(values: NDArray[np.float64], best: int) -> float:
    """Return the peak of the parabola through the best value and its neighbours, in grid steps from it."""
    if best == 0 or best == len(values) - 1:
        return 0.0
    left, middle, right = values[best - 1 : best + 2]
    bend = left - 2 * middle + right
    if not np.isfinite(bend) or bend > -1e-12:
        return 0.0
    return float(np.clip((left - right) / (2 * bend), -1, 1))
