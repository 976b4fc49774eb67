"""Corrects identities over the whole take: where two persons may have been exchanged, bones decide.

Between these moments a person is followed reliably. The bones of each stretch are compared with those of the first
one in which each was seen; a stretch whose bones are clearly the other's is given to the other.
"""

from collections.abc import Callable
from itertools import combinations, pairwise

import numpy as np
from numpy.typing import NDArray

from studio.engine.identity.crowd import CLEAR_M, SeenBody, Someone

_APART_S = 1.0
"""Moments that follow each other more closely than this are one meeting."""

_LEAST_BODIES = 30
"""Least number of bodies of each person in a stretch that is used."""

BonesOf = Callable[[SeenBody], NDArray[np.float64]]
"""Returns the lengths of a body's bones [m], shape (21,); NaN = not clearly seen."""


def settle(people: list[Someone], times_s: NDArray[np.float64], bones_of: BonesOf) -> int:
    """Exchange bodies between persons where their bones require it; return the number of exchanges.

    Args:
        people: everybody; their `sightings` change.
        times_s: stage time of each frame [s].
        bones_of: measures a body.
    """
    exchanged = 0
    measured: dict[SeenBody, NDArray[np.float64]] = {}
    for first, second in combinations(range(len(people)), 2):
        meetings = _meetings(people, first, second, times_s)
        if not meetings:
            continue
        pair = people[first], people[second]
        for one in pair:
            measured |= {body: bones_of(body) for body in one.sightings if body not in measured}
        exchanged += _settle_pair(pair, meetings, times_s, measured)
    return exchanged


def _meetings(people: list[Someone], first: int, second: int, times_s: NDArray[np.float64]) -> list[float]:
    """Return the times at which two persons may have been exchanged [s]: when one leapt or came in, else the middle
    of each meeting."""
    sure = {*people[first].leapt, *people[second].leapt}
    came = [
        float(times_s[one.sightings[0].frame]) for one in (people[first], people[second]) if one.sightings
    ]
    if len(came) == 2 and abs(came[0] - came[1]) > _APART_S:
        sure.add(max(came))
    times = sorted([*people[first].met.get(second, []), *sure])
    groups: list[list[float]] = []
    for time_s in times:
        if groups and time_s - groups[-1][-1] < _APART_S:
            groups[-1].append(time_s)
        else:
            groups.append([time_s])
    return [min(sure.intersection(group), default=(group[0] + group[-1]) / 2) for group in groups]


def _settle_pair(
    pair: tuple[Someone, Someone],
    meetings: list[float],
    times_s: NDArray[np.float64],
    measured: dict[SeenBody, NDArray[np.float64]],
) -> int:
    edges = [-np.inf, *meetings, np.inf]
    known: list[NDArray[np.float64] | None] = [None, None]
    swapped, changes = False, 0
    kept: tuple[list[SeenBody], list[SeenBody]] = ([], [])
    for begin, end in pairwise(edges):
        parts = [[body for body in one.sightings if begin <= times_s[body.frame] < end] for one in pair]
        bones = [
            _typical([measured[body] for body in part]) if len(part) >= _LEAST_BODIES else None
            for part in parts
        ]
        gain_m = _gain_m(bones, known)
        if abs(gain_m) > CLEAR_M:
            changes += (gain_m > 0) != swapped
            swapped = gain_m > 0
        if swapped:
            bones.reverse()
        known = [old if old is not None else new for old, new in zip(known, bones, strict=True)]
        for own, part in zip(kept, reversed(parts) if swapped else parts, strict=True):
            own.extend(part)
    if changes:
        for one, own in zip(pair, kept, strict=True):
            one.sightings[:] = own
    return changes


def _gain_m(bones: list[NDArray[np.float64] | None], known: list[NDArray[np.float64] | None]) -> float:
    """Return by how much better exchanged bones fit the known ones, mean over known bones [m]; 0 = none known."""
    gains = []
    for k in range(2):
        if (
            (told := known[k]) is not None
            and (own := bones[k]) is not None
            and (other := bones[1 - k]) is not None
        ):
            gains.append(_apart_m(own, told) - _apart_m(other, told))
    return float(np.mean(gains)) if gains else 0.0


def _typical(bones: list[NDArray[np.float64]]) -> NDArray[np.float64]:
    """Return the median length of each bone, shape (21,); NaN = rarely seen."""
    lengths = np.array(bones)
    enough = np.isfinite(lengths).sum(axis=0) >= _LEAST_BODIES // 2
    out = np.full(lengths.shape[1], np.nan)
    out[enough] = np.nanmedian(lengths[:, enough], axis=0)
    return out


def _apart_m(bones: NDArray[np.float64], others: NDArray[np.float64]) -> float:
    apart = np.abs(bones - others)
    seen = np.isfinite(apart)
    return float(apart[seen].mean()) if seen.any() else 0.0
