"""Combinations of the switches in which every value of one switch meets every value of every other at least once."""

import itertools

import numpy as np

from studio.engine.base.errors import NotAvailableError
from studio.engine.model.settings.settings import SolveSettings, set_switch
from tests.engine.switch_values import CHOICES

NUMBERS = {
    "cameras": ("all", "b"),
    "confidence_threshold": ("0", "0.75", "1"),
    "flexibility": ("0", "1", "2"),
    "relax_pose": ("0", "0.1", "1"),
    "bone_length_limit": ("off", "2"),
    "displacement_limits_m_s.left_wrist": ("0.2", "8"),
    "effectors.left_wrist.reach": ("0", "1"),
    "effectors.right_wrist.pull": ("0.2", "1"),
    "effectors.left_knee.resist": ("0", "1"),
    "look_at_point_m": ("0,-2,1.6", "0.1,1,-1"),
}
"""Values of the switches that take numbers: the ends, the usual and the unusual."""


def available() -> dict[str, tuple[str, ...]]:
    """Every switch's values that this version supports, except `finish`, which does not apply to single frames."""
    values = {}
    for key, choices in (CHOICES | NUMBERS).items():
        if key != "finish":
            values[key] = tuple(value for value in choices if _does(key, value))
    return {key: some for key, some in values.items() if len(some) > 1}


def _does(key: str, value: str) -> bool:
    try:
        set_switch(SolveSettings(), key, value)
    except NotAvailableError:
        return False
    return True


def pairwise(values: dict[str, tuple[str, ...]], seed: int = 0) -> list[tuple[str, ...]]:
    """Return lists of `key=value`, each with every key, that together hold every pair of values.

    Greedy: the best of 12 random candidates is kept. Each is completed key by key with the value of most pairs left.
    """
    rng, keys = np.random.default_rng(seed), list(values)
    left = {
        frozenset(((a, x), (b, y)))
        for a, b in itertools.combinations(keys, 2)
        for x in values[a]
        for y in values[b]
    }
    found = []
    while left:
        best, best_gain, waiting = {}, 0, sorted(sorted(pair) for pair in left)
        for _ in range(12):
            row = dict(waiting[int(rng.integers(len(waiting)))])
            for key in rng.permutation([k for k in keys if k not in row]):
                gains = [
                    sum(frozenset(((key, v), item)) in left for item in row.items()) for v in values[key]
                ]
                row[str(key)] = values[key][int(np.argmax(gains))]
            gain = sum(frozenset(pair) in left for pair in itertools.combinations(row.items(), 2))
            if gain > best_gain:
                best, best_gain = row, gain
        left -= {frozenset(pair) for pair in itertools.combinations(best.items(), 2)}
        found.append(tuple(f"{key}={best[key]}" for key in keys))
    return found
