"""Draws: sides balanced over voters, every order equally likely, all of it from the seed."""

from collections import Counter
from itertools import permutations

import msgspec
import numpy as np
from scipy.stats import chisquare

from studio.review.blind.draw import showings
from tests.review.blind.tests_made import made


def test_sides_are_balanced_and_repeats_are_exchanged(tmp_path) -> None:
    _, test = made(tmp_path, count=8, repeats=3)
    left = np.zeros(8)
    for voter in range(100):
        shown = showings(test, voter)
        assert len(shown) == 11 and len({(s.pair, s.repeat) for s in shown}) == 11
        own = {(s.pair, s.repeat): s.a_left for s in shown}
        for pair in range(8):
            left[pair] += own[(pair, False)]
            if (pair, True) in own:
                assert own[(pair, True)] != own[(pair, False)]
    assert (np.abs(left - 50) <= 5).all()


def test_every_order_is_equally_likely(tmp_path) -> None:
    _, test = made(tmp_path, count=3, repeats=0)
    orders = Counter(tuple(s.pair for s in showings(test, voter)) for voter in range(6000))
    assert set(orders) == set(permutations(range(3)))
    assert chisquare(list(orders.values())).pvalue > 1e-4


def test_the_draws_follow_from_the_seed(tmp_path) -> None:
    _, test = made(tmp_path)
    again = msgspec.json.decode(msgspec.json.encode(test), type=type(test))
    assert showings(again, 17) == showings(test, 17)
    other = msgspec.structs.replace(test, seed=test.seed + 1)
    assert any(showings(other, voter) != showings(test, voter) for voter in range(5))


def test_a_room_sees_one_thing(tmp_path) -> None:
    _, test = made(tmp_path, supervised=True)
    assert len({showings(test, voter) for voter in range(20)}) == 1
