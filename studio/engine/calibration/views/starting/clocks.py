"""First clock offset between two cameras, at which the network's guesses of the body move alike.

For each offset, one rotation aligns the guesses minus their means over time; the offset with the highest correlation
is the result. This needs neither lens nor place of a camera.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from studio.engine.calibration.views.seen.tracks import ViewTrack, apart_within_s, nearest

LONGEST_S = 2.0
"""Largest offset in the first search."""
FARTHEST_S, FARTHEST_SHARE = 20.0, 0.4
"""Largest offset in the second search, if the first finds none, also as a share of the shorter stream."""
_SURE = 0.35
_STEP_S, _COARSE_S = 1.0 / 60.0, 1.0 / 15.0
_LEAST_FRAMES = 20


@dataclass(frozen=True)
class Together:
    """Relation of two cameras in time.

    Attributes:
        ahead_s: what is added to the second camera's stamps to give the first one's clock [s].
        correlation: of the motions at that offset, up to 1; 0 = nothing in common.
        frames: number of instants that both saw.
    """

    ahead_s: float
    correlation: float
    frames: int


def compare(a: ViewTrack, b: ViewTrack) -> Together:
    """Return the possible offset at which the two tracks' motions are most alike."""
    if min(len(a.time_s), len(b.time_s)) < _LEAST_FRAMES:
        return Together(0.0, 0.0, 0)
    within_s = apart_within_s(a, b)
    near = _best(a, b, _steps(0.0, min(LONGEST_S, within_s), _STEP_S))
    shorter = min(a.time_s[-1] - a.time_s[0], b.time_s[-1] - b.time_s[0])
    farthest = min(FARTHEST_S, FARTHEST_SHARE * shorter, within_s)
    if near.correlation > _SURE or farthest <= LONGEST_S:
        return near
    coarse = _best(a, b, _steps(0.0, farthest, _COARSE_S))
    far = _best(a, b, _steps(coarse.ahead_s, 2 * _COARSE_S, _STEP_S))
    return far if far.correlation > near.correlation else near


def _steps(middle_s: float, longest_s: float, step_s: float) -> NDArray[np.float64]:
    count = round(longest_s / step_s)
    count = max(count, 1)
    return middle_s + np.arange(-count, count + 1, dtype=np.float64) * step_s


def _best(a: ViewTrack, b: ViewTrack, steps: NDArray[np.float64]) -> Together:
    """Return the best of evenly spaced offsets [s]."""
    values, counts = np.zeros(len(steps)), np.zeros(len(steps), dtype=np.int64)
    for i, ahead in enumerate(steps):
        values[i], counts[i] = _alike(a, b, float(ahead))
    values[counts < _LEAST_FRAMES] = 0.0
    # a gait repeats itself, so longer overlaps weigh more
    weighed = values * np.sqrt(counts / max(int(counts.max()), 1))
    best = int(weighed.argmax())
    if counts[best] < _LEAST_FRAMES:
        return Together(0.0, 0.0, int(counts.max()))
    ahead = float(steps[best] + _peak(weighed, best) * (steps[1] - steps[0]))
    return Together(ahead, float(values[best]), int(counts[best]))


def _alike(a: ViewTrack, b: ViewTrack, ahead_s: float) -> tuple[float, int]:
    """Return the correlation of two motions at an offset, up to one rotation, and the number of instants."""
    rows, near = nearest(b, a.time_s - ahead_s)
    both = a.seen & b.seen[rows] & near[:, None]
    count = int((both.sum(axis=1) >= 8).sum())
    if count < _LEAST_FRAMES:
        return 0.0, count
    x, y = _changes(a.world_m, both), _changes(b.world_m[rows], both)
    s = np.linalg.svd(np.einsum("fja,fjb->ab", x, y), compute_uv=False)
    return float(s.sum() / np.sqrt((x**2).sum() * (y**2).sum() + 1e-12)), count


def _changes(world: NDArray[np.float64], used: NDArray[np.bool_]) -> NDArray[np.float64]:
    """Return guesses minus each joint's mean over the used instants; 0 where not used."""
    w = used[..., None]
    return (world - (world * w).sum(axis=0) / np.maximum(w.sum(axis=0), 1)) * w


def _peak(values: NDArray[np.float64], i: int) -> float:
    """Return the offset from the highest value to the peak of the parabola through its neighbours, -0.5..0.5."""
    if not 0 < i < len(values) - 1:
        return 0.0
    left, middle, right = values[i - 1 : i + 2]
    curve = left - 2 * middle + right
    return float(np.clip(0.5 * (left - right) / curve, -0.5, 0.5)) if curve < -1e-12 else 0.0
