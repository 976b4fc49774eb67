"""The minimum of a quadratic function in a box, checked by its optimality conditions."""

import numpy as np
import pytest

from studio.engine.solve.ik.box_qp import UNBOUNDED, BoxQP

COUNT = 53


def problem(seed):
    """A stiff problem like that of the solve: joints weigh ten thousand times as much as the damping."""
    rng = np.random.default_rng(seed)
    rows = 100 * rng.normal(size=(40, COUNT))
    return rows.T @ rows + 1e-3 * np.eye(COUNT), rows.T @ (100 * rng.normal(size=40)), rng


def assert_least(H, c, low, high, x):
    """Check the conditions of Karush, Kuhn and Tucker: the function falls only out of the box."""
    slope = (H @ x + c) / np.abs(c).max()
    assert (low <= x).all() and (x <= high).all()
    assert (slope[x > low + 1e-9] < 1e-6).all() and (slope[x < high - 1e-9] > -1e-6).all()


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("width", [1e-4, 0.05, 0.6, UNBOUNDED])
def test_it_is_the_least_in_the_box(seed, width):
    H, c, rng = problem(seed)
    low, high = -width * rng.random(COUNT), width * rng.random(COUNT)
    low[:6], high[:6] = -UNBOUNDED, UNBOUNDED
    low[6:20] = 0.0  # hinges at an end
    assert_least(H, c, low, high, BoxQP(COUNT).solve(H, c, low, high))


def test_a_box_of_no_width_is_the_answer():
    H, c, rng = problem(1)
    here = rng.normal(size=COUNT)
    assert BoxQP(COUNT).solve(H, c, here, here) == pytest.approx(here)
