"""Keys of animation curves: their positions, and slopes for cubic curves.

Between keys a cubic curve is a Hermite cubic. With automatic tangents its slope at a key is that of the chord of the
two neighbours. This follows smooth motion closely, but overshoots by 7 % of the height on either side of a jump.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import median_filter

from studio.engine.base.compiled import compiled

Array = NDArray[np.float64]

JUMP_STEP = 2.0
"""Smallest jump from key to key [deg or cm]; the overshoot beside a smaller step is under 0.15."""

JUMP_RATIO = 6.0
"""A jump is this many times the median step around it, so it lasts for a few keys at most."""

_AROUND = 9


MISS = 0.02
"""Automatic tangents are kept if the curve follows the motion between its keys to within this [deg or cm]."""


@dataclass(frozen=True)
class CurveKeys:
    """Keys of one curve.

    Attributes:
        frames: their frame numbers, shape (key_count,), increasing.
        values: [cm or deg], shape (key_count,).
        slopes: to the right of each key [1/s], shape (key_count,); NaN = automatic on both sides.
        left_slopes: to its left [1/s], shape (key_count,); None = those to the right.
    """

    frames: NDArray[np.int64]
    values: Array
    slopes: Array
    left_slopes: Array | None = None

    @property
    def lefts(self) -> Array:
        return self.slopes if self.left_slopes is None else self.left_slopes


def curve_keys(
    track: Array, frames_per_second: float, interpolation: str, *, between: Array | None = None
) -> CurveKeys:
    """Return a key per frame.

    Cubic curves have explicit slopes where automatic ones err most. At either end the automatic slope would be the
    chord to the only neighbour; the curve has the slope of the parabola through three keys. Beside jumps it has
    Steffen's limited slope, with which it stays between its keys. Where the motion between the keys is known and
    a curve with these slopes misses it by more than `MISS`, the slopes at both ends of that interval are fitted to
    it by least squares.

    Source of the limited slope: M. Steffen, "A simple method for monotonic interpolation in one dimension",
    Astronomy and Astrophysics 239, 1990, equation 11.

    Args:
        track: a value per frame [cm or deg], shape (frame_count,).
        frames_per_second: of the frames.
        interpolation: `cubic`, `linear` or `constant`.
        between: the motion with equal steps between the frames, shape (steps * (frame_count - 1) + 1,).
    """
    count = len(track)
    slopes = np.full(count, np.nan)
    if interpolation != "cubic" or count < 3:
        return CurveKeys(frames=np.arange(count), values=track, slopes=slopes)
    lefts = frame_slopes(track)
    jumps = _beside_jumps(track)
    lefts[jumps] = _limited(track, jumps)
    rights = lefts.copy()
    own = np.zeros(count, bool)
    own[jumps] = own[[0, -1]] = True
    if between is not None:
        fitted, ahead, behind = _fitted_slopes(track, lefts, between)
        rights[:-1][fitted], lefts[1:][fitted] = ahead[fitted], behind[fitted]
        own[:-1] |= fitted
        own[1:] |= fitted
    rights[~own] = lefts[~own] = np.nan
    return CurveKeys(np.arange(count), track, rights * frames_per_second, lefts * frames_per_second)


def _fitted_slopes(track: Array, slopes: Array, between: Array) -> tuple[NDArray[np.bool_], Array, Array]:
    """Return the intervals between keys that need fitted slopes, and these slopes per frame: at the start and the
    end.

    Slopes that are not determined (one step in the middle) change as little as possible.
    """
    steps = (len(between) - 1) // (len(track) - 1)
    inner = between[:-1].reshape(-1, steps)[:, 1:]  # (frame_count - 1, steps - 1)
    t = np.arange(1, steps) / steps
    shapes = np.stack([t * (1 - t) ** 2, t**2 * (t - 1)])  # (2, steps - 1)
    straight = np.outer(track[:-1], (1 + 2 * t) * (1 - t) ** 2) + np.outer(track[1:], t**2 * (3 - 2 * t))
    ends = np.stack([slopes[:-1], slopes[1:]], axis=1)
    missing = inner - straight - ends @ shapes
    ends = ends + missing @ np.linalg.pinv(shapes)
    return np.abs(missing).max(axis=1) > MISS, ends[:, 0], ends[:, 1]


def frame_slopes(track: Array) -> Array:
    """Return slopes per frame: central differences, and those of a parabola at the ends; at least 3 frames."""
    slopes = np.gradient(track)
    slopes[0] = (-3 * track[0] + 4 * track[1] - track[2]) / 2
    slopes[-1] = (3 * track[-1] - 4 * track[-2] + track[-3]) / 2
    return slopes


def _beside_jumps(track: Array) -> NDArray[np.int64]:
    """Return the inner keys on either side of a jump."""
    step = np.abs(np.diff(track))
    if step.max() <= JUMP_STEP:
        return np.zeros(0, np.int64)
    jumps = step > np.maximum(JUMP_STEP, JUMP_RATIO * median_filter(step, _AROUND, mode="nearest"))
    return 1 + np.flatnonzero(jumps[1:] | jumps[:-1])


def _limited(track: Array, keys: NDArray[np.int64]) -> Array:
    """Return Steffen's slopes per frame at inner keys."""
    before, after = track[keys] - track[keys - 1], track[keys + 1] - track[keys]
    smallest = np.minimum(np.minimum(np.abs(before), np.abs(after)), np.abs(before + after) / 4)
    return (np.sign(before) + np.sign(after)) * smallest


def fitted_keys(track: Array, frames_per_second: float, tolerance: float, interpolation: str) -> CurveKeys:
    """Return the keys that keep a curve within a tolerance of every frame.

    Each next key is as far ahead as possible: a cubic with a slope fitted by least squares, or a straight line, stays
    within the tolerance up to it.

    Args:
        track: a value per frame, shape (frame_count,).
        frames_per_second: of the frames.
        tolerance: in the unit of the track.
        interpolation: `cubic` or `linear`.
    """
    count = len(track)
    cubic = interpolation == "cubic"
    if count < 3 or np.ptp(track) <= tolerance / 2:
        keep = np.array([0])
        return CurveKeys(frames=keep, values=track[keep], slopes=np.array([0.0 if cubic else np.nan]))
    frames, slopes = _greedy(np.ascontiguousarray(track), frame_slopes(track), tolerance, cubic)
    slopes = slopes * frames_per_second if cubic else np.full(len(frames), np.nan)
    return CurveKeys(frames=frames, values=track[frames], slopes=slopes)


def values_between(keys: CurveKeys, frame_count: int, frames_per_second: float) -> Array:
    """Return a curve's value at every frame: straight lines between keys without slopes, else a cubic."""
    frames = np.arange(frame_count)
    if len(keys.frames) == 1 or np.isnan(keys.slopes[0]):
        return np.interp(frames, keys.frames, keys.values)
    k = np.clip(np.searchsorted(keys.frames, frames, side="right") - 1, 0, len(keys.frames) - 2)
    span = (keys.frames[k + 1] - keys.frames[k]).astype(float)
    t = (frames - keys.frames[k]) / span
    low, high = keys.slopes[k] / frames_per_second * span, keys.lefts[k + 1] / frames_per_second * span
    return (
        keys.values[k] * (1 + 2 * t) * (1 - t) ** 2
        + low * t * (1 - t) ** 2
        + keys.values[k + 1] * t**2 * (3 - 2 * t)
        + high * t**2 * (t - 1)
    )


@compiled
def _fit_line(track, a, b, tolerance):
    """Return whether a straight line from frame a to b stays within the tolerance."""
    for i in range(a + 1, b):
        if abs(track[a] + (track[b] - track[a]) * (i - a) / (b - a) - track[i]) > tolerance:
            return False
    return True


@compiled
def _fit(track, slopes, a, slope, b, tolerance, cubic):
    """Return whether a cubic or a line from frame a to b stays within the tolerance, and the slope at b."""
    if not cubic:
        return _fit_line(track, a, b, tolerance), 0.0
    span = b - a
    if span == 1:
        return True, slopes[b]
    ahead = slopes[b]
    if span > 2:
        product, square = 0.0, 1e-12
        for i in range(a + 1, b):
            t = (i - a) / span
            known = (
                track[a] * (1 + 2 * t) * (1 - t) ** 2
                + slope * span * t * (1 - t) ** 2
                + track[b] * t**2 * (3 - 2 * t)
            )
            shape = span * t**2 * (t - 1)
            product += shape * (track[i] - known)
            square += shape * shape
        ahead = product / square
    for i in range(a + 1, b):
        t = (i - a) / span
        value = (
            track[a] * (1 + 2 * t) * (1 - t) ** 2
            + slope * span * t * (1 - t) ** 2
            + track[b] * t**2 * (3 - 2 * t)
            + ahead * span * t**2 * (t - 1)
        )
        if abs(value - track[i]) > tolerance:
            return False, ahead
    return True, ahead


@compiled
def _greedy(track, slopes, tolerance, cubic):
    """Return frames of keys and their slopes per frame."""
    count = len(track)
    frames = np.empty(count, np.int64)
    out = np.empty(count)
    frames[0], out[0], keys, a = 0, slopes[0], 1, 0
    while a < count - 1:
        good, good_slope, step = a + 1, slopes[a + 1], 2
        bad = count
        while a + step < count:  # double the step until it no longer fits
            fits, ahead = _fit(track, slopes, a, out[keys - 1], a + step, tolerance, cubic)
            if not fits:
                bad = a + step
                break
            good, good_slope = a + step, ahead
            step = min(2 * step, count - 1 - a) if a + step < count - 1 else count
        while bad - good > 1:  # then bisect
            middle = (good + bad) // 2
            fits, ahead = _fit(track, slopes, a, out[keys - 1], middle, tolerance, cubic)
            if fits:
                good, good_slope = middle, ahead
            else:
                bad = middle
        a = good
        frames[keys], out[keys] = a, good_slope
        keys += 1
    return frames[:keys].copy(), out[:keys].copy()
