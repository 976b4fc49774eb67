"""Places of the performers' names in the view: over their heads, one above the other if two stand close."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from studio.engine.model.frames import StepResult
from studio.engine.model.joints import OUTPUT_INDEX

_HEAD = OUTPUT_INDEX["Head"]
_OVER_HEAD_M = 0.27
_APART_M = 0.2
"""Difference in height of the names of two performers in one place [m]."""

_CLOSE_M, _FAR_M = 0.6, 1.0
"""Distances of two performers up to which their names are fully separated, and from which they are unchanged [m]."""


def name_places(steps: Mapping[int, StepResult]) -> dict[int, NDArray[np.float64]]:
    """Return the place of each performer's name [m], shape (3,), by number; those without a pose are left out."""
    placed: dict[int, NDArray[np.float64]] = {}
    for number, one in sorted(steps.items()):
        place = one.positions_m[_HEAD] + [0.0, 0.0, _OVER_HEAD_M]
        if not np.isfinite(place).all():
            continue
        for other in sorted(placed.values(), key=lambda other: float(other[2])):
            far_m = float(np.linalg.norm(place[:2] - other[:2]))
            apart_m = _APART_M * float(np.clip((_FAR_M - far_m) / (_FAR_M - _CLOSE_M), 0.0, 1.0))
            if abs(place[2] - other[2]) < apart_m:
                place[2] = other[2] + apart_m
        placed[number] = place
    return placed
