"""Minimum of a quadratic function in a box."""

from ctypes import c_int

import daqp
import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


UNBOUNDED = 1e30
"""An infinite bound."""


class BoxQP:
    """Minimises x.H.x / 2 + c.x with every x between its bounds.

    The limits of hinges are a box. DAQP (Arnström, Bemporad, Axehill, "A dual active-set solver for embedded
    quadratic programming using recursive LDL^T updates", 2022) takes less than half of the time with bounds than with
    the same limits as rows of a matrix.
    """

    def __init__(self, count: int) -> None:
        self._no_rows = np.zeros((0, count))
        self._sense = np.zeros(count, dtype=c_int)

    def solve(self, H: Array, c: Array, low: Array, high: Array) -> Array:
        """Return x, shape (count,).

        Args:
            H: positive definite, shape (count, count).
            c: shape (count,).
            low: bounds, each at most that of `high`.
            high: bounds.
        """
        x, _, flag, _ = daqp.solve(H, c, self._no_rows, high, low, self._sense)
        assert flag > 0, f"a convex function has a least value in a box; DAQP says {flag}"
        return np.clip(x, low, high)
