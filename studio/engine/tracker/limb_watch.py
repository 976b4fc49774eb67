"""When a limb is searched for: as soon as it explains its points worse than it usually does, and not all the time."""

import numpy as np
from numpy.typing import NDArray

from studio.engine.tracker.body import PARTS

_LEAST_M2 = 0.12
"""A limb that leaves less than this unexplained is where it should be [m2]."""
_WORSE = 0.0
_PAUSE = 1
"""After a search that found nothing, so many frames pass before the next."""
_LONGEST_PAUSE = 0
_FORGET = 0.05


class LimbWatch:
    """What each part usually leaves unexplained, and which limbs are to be searched for.

    Attributes:
        costs_m2: of the last frame, by part, shape (5,).
    """

    def __init__(self) -> None:
        self.costs_m2: NDArray[np.float64] = np.zeros(len(PARTS))
        self._usual = np.full(len(PARTS), _LEAST_M2)
        self._pause = np.zeros(len(PARTS), dtype=int)
        self._next = np.zeros(len(PARTS), dtype=int)

    def threshold_m2(self, part: int) -> float:
        """Return the cost from which the part is searched for in this frame [m2]."""
        if self._next[part] > 0:
            self._next[part] -= 1
            return np.inf
        return max(_LEAST_M2, _WORSE * float(self._usual[part]))

    def told(self, part: int, cost_m2: float, *, searched: bool, found: bool) -> None:
        """Take what a frame cost, whether the limb was searched for, and whether another pose was found."""
        self.costs_m2[part] = cost_m2
        share = _FORGET if cost_m2 > self._usual[part] else 4 * _FORGET
        self._usual[part] += share * (min(cost_m2, 0.3) - self._usual[part])
        if searched:
            self._pause[part] = 0 if found else min(max(2 * self._pause[part], _PAUSE), _LONGEST_PAUSE)
            self._next[part] = self._pause[part]
        elif cost_m2 < _LEAST_M2:
            self._pause[part] = self._next[part] = 0
