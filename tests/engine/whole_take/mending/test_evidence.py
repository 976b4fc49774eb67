"""The cost of an error of cameras."""

import numpy as np
import pytest

from studio.engine.whole_take.mending.evidence import LIKE_FRAMES, NO_END, best_of, jumps_of

COUNT, PIN = 60, 30


def test_an_end_of_an_error_that_nobody_sees_costs_something():
    """Jumps are unknown near the first and the last frame, so that ends would otherwise cost nothing there."""
    unknown = np.isnan(jumps_of(np.zeros((COUNT, 1, 1, 3)))[:, 0, 0, 0])
    jumps = np.where(unknown, 0.0, 1000.0)
    at = slice(PIN, PIN + 1)
    error = best_of(np.full(COUNT, -1.0), jumps, jumps, at, (0,), np.zeros(3), in_body=False, follows=True)
    assert error.rows == slice(0, COUNT)
    assert error.cost == pytest.approx(2.0 * NO_END - COUNT / LIKE_FRAMES, abs=1.0)
