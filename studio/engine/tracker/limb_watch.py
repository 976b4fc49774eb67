"""When a limb is searched for: once it leaves too much unexplained, in every other frame while nothing is found."""

import numpy as np
from numpy.typing import NDArray

from studio.engine.tracker.body import PARTS

_LEAST_M2 = 0.12
"""A limb that leaves less than this unexplained is where it should be [m2]."""
_PAUSE = 1
"""After a search that found nothing, so many frames pass before the next."""
_KEPT = 0.93
"""Of what was lately unexplained, from frame to frame."""


class LimbWatch:
    """What each part leaves unexplained, and which limbs are to be searched for.

    Attributes:
        costs_m2: of the last frame, by part, shape (5,). lately_m2: the largest of about the last half second.
    """

    def __init__(self) -> None:
        self.costs_m2: NDArray[np.float64] = np.zeros(len(PARTS))
        self.lately_m2: NDArray[np.float64] = np.zeros(len(PARTS))
        self._pause = np.zeros(len(PARTS), dtype=int)

    def threshold_m2(self, part: int) -> float:
        """Return the cost from which the part is searched for in this frame [m2]."""
        if self._pause[part] > 0:
            self._pause[part] -= 1
            return np.inf
        return _LEAST_M2

    def told(self, part: int, cost_m2: float, *, searched: bool, found: bool) -> None:
        """Take what a frame cost, whether the limb was searched for, and whether another pose was found."""
        self.costs_m2[part] = cost_m2
        self.lately_m2[part] = max(cost_m2, _KEPT * self.lately_m2[part])
        if searched:
            self._pause[part] = 0 if found else _PAUSE
        elif cost_m2 < _LEAST_M2:
            self._pause[part] = 0
