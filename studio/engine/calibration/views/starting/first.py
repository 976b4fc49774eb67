"""The first rig: cameras placed in pairs, then chained by the pairs that fit best."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np

from studio.engine.base.geometry import invert_transform, make_transform
from studio.engine.calibration.views.adjusting.adjust import Adjustment, FittedRig, Freedom
from studio.engine.calibration.views.adjusting.rig import CameraRig
from studio.engine.calibration.views.adjusting.sides import brought_together, misfit
from studio.engine.calibration.views.seen.bodies import LIMBS, Array, lengths, limbs_m
from studio.engine.calibration.views.seen.tracks import ViewTrack, nearest
from studio.engine.calibration.views.starting.clocks import Together, compare
from studio.engine.calibration.views.starting.start import bodies, places

_FEW = 60
_LOOSE = 4.0
_TRIED = 3
_ROUNDS = 8
_SMALL = 1e-3
_STEP_S = 1.062 / 30.0
"""Step between instants, no multiple of frame periods, so that instants lie everywhere between frames. If all have
the same distance from a frame, lines fitted to noisy landmarks agree best at a wrong clock offset."""
_LEAST_JOINTS = 8


@dataclass(frozen=True)
class ViewPair:
    """Two cameras placed relative to each other.

    Attributes:
        together: their relation in time.
        T: transform from the second camera to the first [m].
        misfit: error of their rays, see `sides.misfit`; infinite if they saw nothing together.
    """

    together: Together
    T: Array
    misfit: float


def first_pairs(
    tracks: list[ViewTrack], height_m: float, told: Callable[[float], None] = lambda share: None
) -> dict[tuple[int, int], ViewPair]:
    """Return all pairs of cameras, placed by the network's guesses of the body."""
    guessed = [bodies(track) for track in tracks]
    every = list(combinations(range(len(tracks)), 2))
    out = {}
    for k, (i, j) in enumerate(every):
        out[i, j] = _pair([tracks[i], tracks[j]], [guessed[i], guessed[j]], height_m)
        told((k + 1) / len(every))
    return out


def _pair(tracks: list[ViewTrack], guessed: list[Array], height_m: float) -> ViewPair:
    together = compare(tracks[0], tracks[1])
    tried = places(tracks[0], tracks[1], guessed[0], guessed[1], together.ahead_s) if together.frames else []
    if not tried:
        return ViewPair(together, np.eye(4), np.inf)
    times = common_instants(tracks, np.array([0.0, together.ahead_s]), _FEW)
    rigs = [_rig([np.eye(4), invert_transform(T)], tracks, [0.0, together.ahead_s]) for T in tried]
    costs = [misfit(rig, tracks, times, 3 * _LOOSE) for rig in rigs]
    best, least = tried[0], np.inf
    for i in np.argsort(costs, kind="stable")[:_TRIED]:
        fit = adjust_places(rigs[i], tracks, times, height_m, _ROUNDS)
        cost = misfit(fit.rig, tracks, times, _LOOSE)
        if cost < least:
            best = invert_transform(make_transform(fit.rig.turns[1], fit.rig.shifts[1]))
            least = cost
    return ViewPair(together, best, least)


def adjust_places(
    rig: CameraRig, tracks: list[ViewTrack], times_s: Array, height_m: float, rounds: int
) -> FittedRig:
    """Return the rig after an adjustment of its places alone, with all errors assumed large."""
    count = len(tracks)
    _, samples, joints = brought_together(rig, tracks, times_s)
    limbs = limbs_m(height_m)
    size = limbs / lengths(joints)[LIMBS].sum()
    rig, joints = replace(rig, shifts=rig.shifts * size), joints * size
    freedom = Freedom((-1,) * count, (0.0,) * count, (False,) * count, False)
    fit = FittedRig(rig, joints, lengths(joints))
    return Adjustment(samples, times_s, rig, freedom, limbs, _LOOSE).run(fit, rounds, _SMALL)


def chain(pairs: dict[tuple[int, int], ViewPair], tracks: list[ViewTrack]) -> CameraRig | None:
    """Return the rig chained from the first camera by the best pairs; None if a camera has no pair."""
    places: dict[int, Array] = {0: np.eye(4)}
    ahead = {0: 0.0}
    while len(places) < len(tracks):
        open_pairs = [
            (pair.misfit, key) for key, pair in pairs.items() if (key[0] in places) != (key[1] in places)
        ]
        cost, (i, j) = min(open_pairs)
        if not np.isfinite(cost):
            return None
        pair = pairs[i, j]
        if i in places:
            places[j] = places[i] @ pair.T
            ahead[j] = ahead[i] + pair.together.ahead_s
        else:
            places[i] = places[j] @ invert_transform(pair.T)
            ahead[i] = ahead[j] - pair.together.ahead_s
    order = range(len(tracks))
    return _rig([invert_transform(places[c]) for c in order], tracks, [ahead[c] for c in order])


def common_instants(tracks: list[ViewTrack], ahead_s: Array, most: int) -> Array:
    """Return at most `most` instants [s], on the clock to which the offsets lead, at which two or more cameras see a
    body; evenly chosen from a regular grid."""
    starts = [track.time_s[0] + ahead for track, ahead in zip(tracks, ahead_s, strict=True)]
    ends = [track.time_s[-1] + ahead for track, ahead in zip(tracks, ahead_s, strict=True)]
    times = np.arange(min(starts), max(ends), _STEP_S)
    count = np.zeros(len(times), dtype=np.int64)
    for track, ahead in zip(tracks, ahead_s, strict=True):
        rows, near = nearest(track, times - ahead)
        count += near & (track.seen[rows].sum(axis=1) >= _LEAST_JOINTS)
    times = times[count >= 2]
    return times[np.unique(np.linspace(0, len(times) - 1, min(most, len(times))).round().astype(int))]


def _rig(to_cameras: list[Array], tracks: list[ViewTrack], ahead_s: list[float]) -> CameraRig:
    T, count = np.stack(to_cameras), len(tracks)
    focals = np.array([track.focal for track in tracks])
    return CameraRig(
        T[:, :3, :3], T[:, :3, 3], focals, np.zeros(count), np.array(ahead_s), np.zeros((count, 2))
    )
