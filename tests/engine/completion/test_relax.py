"""Relax pose: a share of the way to the middle of each range."""

import numpy as np
import pytest

from studio.engine.completion.relax import relaxed
from tests.engine.walkers import humanoid, random_q


def test_the_weight_is_the_share_of_the_way_to_the_middle():
    body = humanoid()
    q = random_q(body, np.random.default_rng(1))
    middle = body.range_rad.mean(axis=1)
    assert relaxed(body, q, 0.0) == pytest.approx(q)
    assert relaxed(body, q, 1.0)[7:] == pytest.approx(middle)
    assert relaxed(body, q, 0.1)[7:] == pytest.approx(0.9 * q[7:] + 0.1 * middle)


def test_the_hips_stay_and_the_input_is_not_changed():
    body = humanoid()
    q = random_q(body, np.random.default_rng(2))
    before = q.copy()
    assert np.array_equal(relaxed(body, q, 0.7)[:7], q[:7]) and np.array_equal(q, before)


def test_it_stays_within_the_limits():
    body, rng = humanoid(), np.random.default_rng(3)
    low, high = body.range_rad.T
    for weight in (0.1, 0.5, 1.0):
        out = relaxed(body, random_q(body, rng), weight)
        assert (out[7:] >= low).all() and (out[7:] <= high).all()
