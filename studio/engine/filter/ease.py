"""Corrections that come in smoothly: cameras are slower than the output, and a whole correction in one of two output
frames would be a stair."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

EASED = 0.5
"""Share of a correction's stair that is taken away: all of it would be as late again as the joints were early."""


class Ease:
    """Lets a correction by joints that are ahead of the output frame come in until their own time.

    Attributes:
        left: what is still to come, as a tangent step back, shape (nv,).
    """

    def __init__(self, nv: int) -> None:
        self.left = np.zeros(nv)
        self._time_s, self._dt = 0.0, 0.0

    def forget(self) -> None:
        """Nothing is to come."""
        self.left[:] = 0.0

    def go_on(self, dt: float) -> None:
        """Let `dt` [s] pass."""
        self.left *= max(0.0, 1.0 - dt / self._time_s) if self._time_s > 0.0 else 0.0
        self._time_s, self._dt = max(0.0, self._time_s - dt), dt

    def take(self, step: Array, late_s: float) -> None:
        """Take in a correction, shape (nv,), by joints `late_s` [s] ahead of the output frame."""
        if late_s > 0.0:
            self._time_s = late_s
            self.left -= EASED * step * (late_s / (late_s + self._dt))
