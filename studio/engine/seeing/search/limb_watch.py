"""Schedule of limb searches: a limb with a large residual is searched, but only in every other frame while nothing is
found."""

import numpy as np
from numpy.typing import NDArray

from studio.engine.seeing.fitting.cones import PARTS

_LEAST_M2 = 0.12
"""Residual below which a limb is in place [m2]."""
_PAUSE = 1
"""Frames to wait after a search without a result."""
_KEPT = 0.93
"""Share of the recent residual that is kept per frame."""


class LimbWatch:
    """Residual of each part, and the limbs to search.

    Attributes:
        costs_m2: of the last frame, by part, shape (5,). lately_m2: largest in about the last half second.
    """

    def __init__(self) -> None:
        self.costs_m2: NDArray[np.float64] = np.zeros(len(PARTS))
        self.lately_m2: NDArray[np.float64] = np.zeros(len(PARTS))
        self._pause = np.zeros(len(PARTS), dtype=int)

    def threshold_m2(self, part: int) -> float:
        """Return the residual from which the part is searched in this frame [m2]."""
        if self._pause[part] > 0:
            self._pause[part] -= 1
            return np.inf
        return _LEAST_M2

    def told(self, part: int, cost_m2: float, *, searched: bool, found: bool) -> None:
        """Add a frame: the part's residual, whether the limb was searched, and whether another pose was found."""
        self.costs_m2[part] = cost_m2
        self.lately_m2[part] = max(cost_m2, _KEPT * self.lately_m2[part])
        if searched:
            self._pause[part] = 0 if found else _PAUSE
        elif cost_m2 < _LEAST_M2:
            self._pause[part] = 0
