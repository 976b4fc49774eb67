"""Random but balanced orders and sides for each voter, all drawn from the test's seed."""

from dataclasses import dataclass

import numpy as np

from studio.review.blind.model import BlindTest

_ORDERS, _SIDES, _ROOM = 1, 2, 3


@dataclass(frozen=True)
class Showing:
    """One pair as shown to a voter: the pair, whether it is its repeat, and whether `a` is on the left."""

    pair: int
    repeat: bool
    a_left: bool


def showings(test: BlindTest, voter: int) -> tuple[Showing, ...]:
    """Return the pairs of the voter with this number (from 0, in the order of joining), in the order shown.

    Every order is equally likely. Voters 2k and 2k + 1 have opposite sides throughout, so that sides are balanced. A
    repeat exchanges the sides. In a supervised test, all voters see the same.
    """
    number = 0 if test.rules.supervised else voter
    order = np.random.default_rng([test.seed, _ORDERS, number]).permutation(len(test.slots))
    kind = _ROOM if test.rules.supervised else _SIDES
    lefts = np.random.default_rng([test.seed, kind, number // 2]).random(len(test.pairs)) < 0.5
    if number % 2:
        lefts = ~lefts
    return tuple(
        Showing(pair, repeat, bool(lefts[pair]) != repeat) for pair, repeat in (test.slots[i] for i in order)
    )
