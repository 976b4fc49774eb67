"""Conversion between stage time and the time of a solve with faster or slower parts."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from studio.engine.edits.edit import Edit, RetimeEdit
from studio.engine.edits.timing import of_kind, share

STEP_S = 0.005
"""Steps in which the pace is summed [s]."""


class TimeMap:
    """Stage time and the time of a retimed solve, which are equal before the first part that is retimed.

    Within a retimed part a second lasts `factor` seconds; the factor eases in and out over the part's `ease_s`.
    """

    def __init__(self, edits: Sequence[Edit]) -> None:
        """Take the retimed parts among edits."""
        self._retimes = of_kind(edits, RetimeEdit)
        if not self._retimes:
            return
        begin = min(one.start_s - one.ease_s for one in self._retimes)
        end = max(one.end_s + one.ease_s for one in self._retimes)
        self._stage_s = np.linspace(begin, end, max(2, round((end - begin) / STEP_S) + 1))
        pace = np.ones(len(self._stage_s))
        for one in self._retimes:
            pace *= 1.0 + (one.factor - 1.0) * share(one, self._stage_s)
        steps = np.diff(self._stage_s) * 0.5 * (pace[1:] + pace[:-1])
        self._solve_s = begin + np.concatenate([[0.0], np.cumsum(steps)])

    def __bool__(self) -> bool:
        return bool(self._retimes)

    def solve_s(self, stage_s: ArrayLike) -> NDArray[np.float64]:
        """Return the solve's time of stage times [s], any shape."""
        return self._mapped(stage_s, forth=True)

    def stage_s(self, solve_s: ArrayLike) -> NDArray[np.float64]:
        """Return the stage time of a solve's times [s], any shape."""
        return self._mapped(solve_s, forth=False)

    def _mapped(self, times_s: ArrayLike, *, forth: bool) -> NDArray[np.float64]:
        given = np.asarray(times_s, dtype=np.float64)
        if not self._retimes:
            return given
        before, after = (self._stage_s, self._solve_s) if forth else (self._solve_s, self._stage_s)
        beyond = np.maximum(given - before[-1], 0.0) - np.maximum(before[0] - given, 0.0)
        return np.interp(given, before, after) + beyond
