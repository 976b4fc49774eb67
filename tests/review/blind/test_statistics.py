"""Statistics of votes against other libraries, and the thesis's own counts."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import binomtest

from studio.review.blind.statistics import bradley_terry, holm, share


@given(st.integers(0, 300), st.integers(0, 300))
def test_shares_are_those_of_scipy(a: int, b: int) -> None:
    if a + b == 0:
        return
    found, scipy_s = share(a, a + b), binomtest(a, a + b)
    ci = scipy_s.proportion_ci(method="wilson")
    assert (found.low, found.high) == (pytest.approx(ci.low, abs=1e-9), pytest.approx(ci.high, abs=1e-9))
    assert found.p_value == pytest.approx(scipy_s.pvalue, rel=1e-9)


@given(st.lists(st.floats(0, 1), min_size=1, max_size=20), st.floats(0.001, 0.999))
def test_holm_rejects_what_its_steps_reject(p_values: list[float], level: float) -> None:
    """Holm 1979: the smallest of n p-values is held against level / n, the next against level / (n - 1), and so on,
    until one is above."""
    rejected = np.zeros(len(p_values), dtype=bool)
    for step, index in enumerate(np.argsort(p_values)):
        threshold = level / (len(p_values) - step)
        if math.isclose(p_values[index], threshold):
            return  # rounding decides
        if p_values[index] > threshold:
            break
        rejected[index] = True
    np.testing.assert_array_equal(np.array(holm(p_values)) <= level, rejected)


def test_holm_adjusts_as_in_an_example() -> None:
    """R: p.adjust(c(0.01, 0.04, 0.03, 0.005), "holm")."""
    np.testing.assert_allclose(holm([0.01, 0.04, 0.03, 0.005]), [0.03, 0.06, 0.06, 0.02])


@pytest.mark.parametrize(
    ("votes", "of"), [(50, 66), (52, 100), (38, 66), (48, 66), (51, 66), (64, 66), (66, 66)]
)
def test_the_thesis_s_counts(votes: int, of: int) -> None:
    """Wilson's formula and the sum of binomial terms, written out."""
    found = share(votes, of)
    z, p = 1.959963984540054, votes / of
    middle, half = p + z**2 / (2 * of), z * math.sqrt(p * (1 - p) / of + z**2 / (4 * of**2))
    assert found.low == pytest.approx((middle - half) / (1 + z**2 / of), abs=1e-9)
    assert found.high == pytest.approx((middle + half) / (1 + z**2 / of), abs=1e-9)
    tail = sum(math.comb(of, k) for k in range(max(votes, of - votes), of + 1))
    assert found.p_value == pytest.approx(min(1.0, 2 * tail / 2**of), rel=1e-9)


def test_nobody_chose() -> None:
    assert share(0, 0).p_value == 1.0 and (share(0, 0).low, share(0, 0).high) == (0.0, 1.0)


def test_bradley_terry_finds_strengths_that_made_the_votes() -> None:
    true = np.array([0.5, 0.3, 0.15, 0.05])
    games = 20_000
    wins = games * true[:, None] / (true[:, None] + true[None, :])
    np.fill_diagonal(wins, 0.0)
    np.testing.assert_allclose(bradley_terry(wins), true, atol=2e-3)


def test_bradley_terry_stays_finite_where_one_never_lost() -> None:
    strengths = bradley_terry(np.array([[0.0, 10, 10], [0, 0, 5], [0, 5, 0.0]]))
    assert np.isfinite(strengths).all() and strengths[0] > 0.7
    assert strengths[1] == pytest.approx(strengths[2], rel=1e-6)
