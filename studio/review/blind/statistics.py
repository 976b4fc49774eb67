"""Statistics of votes: shares, tests, and strengths for more than two conditions."""

import numpy as np
from msgspec import Struct
from numpy.typing import NDArray

BT_ITERATIONS = 10_000
BT_TOLERANCE = 1e-10


class VoteShare(Struct, frozen=True):
    """Votes for one condition among all choices.

    Attributes:
        votes, of: number of its votes, and of all.
        share: votes / of; NaN without votes (null in a response).
        low, high: 95 % interval (Wilson, "Probable inference", JASA 1927).
        p_value: of the exact two-sided binomial test against a half.
    """

    votes: int
    of: int
    share: float
    low: float
    high: float
    p_value: float


def share(votes: int, of: int) -> VoteShare:
    """Return the share of `votes` of `of`."""
    from scipy.stats import binomtest  # takes most of a second to load: not at the start of the server

    if of == 0:
        return VoteShare(0, 0, float("nan"), 0.0, 1.0, 1.0)
    test = binomtest(votes, of, 0.5)
    interval = test.proportion_ci(0.95, method="wilson")
    return VoteShare(votes, of, votes / of, float(interval.low), float(interval.high), float(test.pvalue))


def holm(p_values: list[float]) -> list[float]:
    """Return p-values corrected for testing several pairs (Holm, Scandinavian Journal of Statistics 6, 1979)."""
    order = np.argsort(p_values)
    factors = len(p_values) - np.arange(len(p_values))
    corrected = np.minimum(np.maximum.accumulate(np.asarray(p_values)[order] * factors), 1.0)
    out = np.empty(len(p_values))
    out[order] = corrected
    return [float(value) for value in out]


def bradley_terry(wins: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return strengths of conditions that sum to 1, shape (n,), by the MM algorithm.

    Both sides of every compared pair get half a win, so that the strength of a condition that never lost is
    finite. Source: Hunter, "MM algorithms for generalized Bradley-Terry models", Annals of Statistics 2004.

    Args:
        wins: number of choices of the row's condition over the column's, shape (n, n); a tie is half a win each.
    """
    met = (wins + wins.T) > 0
    wins = wins + 0.5 * met
    games, won = wins + wins.T, wins.sum(axis=1)
    strengths = np.full(len(wins), 1.0 / max(len(wins), 1))
    for _ in range(BT_ITERATIONS):
        pairs = games / (strengths[:, None] + strengths[None, :])
        total = pairs.sum(axis=1)
        new = np.where(total > 0, won / np.where(total > 0, total, 1.0), strengths)
        new /= new.sum()
        if np.abs(new - strengths).max() < BT_TOLERANCE:
            return new
        strengths = new
    return strengths
