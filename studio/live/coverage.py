"""How much of the stage has been walked while a calibration gathers frames, camera by camera."""

from typing import Any

import numpy as np

from studio.engine.frames import CameraFrame
from studio.engine.joints import INDEX, JOINT_COUNT

CELL_M = 0.5
ENOUGH_POINTS, ENOUGH_CELLS = 600, 8
"""Points of a usual joint, and cells of floor with the hips in them, that a calibration needs."""

_HIPS = INDEX["hips"]


class Coverage:
    """Counts of one camera: where the hips were, and how often each joint was seen."""

    def __init__(self) -> None:
        self._cells: dict[tuple[int, int], int] = {}
        self._points = np.zeros(JOINT_COUNT, dtype=int)

    def add(self, frame: CameraFrame) -> None:
        """Take in a frame."""
        seen = ~np.isnan(frame.positions[:, 0])
        self._points += seen
        if seen[_HIPS]:
            x, _, z = frame.positions[_HIPS]
            cell = (int(np.floor(x / CELL_M)), int(np.floor(z / CELL_M)))
            self._cells[cell] = self._cells.get(cell, 0) + 1

    def to_json(self) -> dict[str, Any]:
        """Return `points` (of a joint, the median of those seen), `cells` (right and away from the camera, in cells
        of half a metre, with a count) and whether it is `enough`."""
        counted = self._points[self._points > 0]
        points = int(np.median(counted)) if len(counted) else 0
        return {
            "points": points,
            "cells": [[x, z, count] for (x, z), count in sorted(self._cells.items())],
            "enough": points >= ENOUGH_POINTS and len(self._cells) >= ENOUGH_CELLS,
        }
