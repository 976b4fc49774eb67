"""Coverage of the stage during the gathering of calibration frames, camera by camera."""

import numpy as np

from studio.engine.model.frames import CameraFrame
from studio.engine.model.joints import INDEX, JOINT_COUNT
from studio.engine.model.triangulation.guess import camera_joints
from studio.live.states import CoverageStatus

CELL_M = 0.5
ENOUGH_POINTS, ENOUGH_CELLS = 600, 8
"""Required for a calibration: points of a median joint, and cells of floor with the hips in them."""

_HIPS = INDEX["hips"]


class Coverage:
    """One camera's counts: places of the hips, and sightings of each joint."""

    def __init__(self) -> None:
        self._cells: dict[tuple[int, int], int] = {}
        self._points = np.zeros(JOINT_COUNT, dtype=int)

    def add(self, frame: CameraFrame) -> None:
        """Add a frame."""
        joints = camera_joints(frame)
        seen = ~np.isnan(joints[:, 0])
        self._points += seen
        if seen[_HIPS]:
            x, _, z = joints[_HIPS]
            cell = (int(np.floor(x / CELL_M)), int(np.floor(z / CELL_M)))
            self._cells[cell] = self._cells.get(cell, 0) + 1

    def status(self) -> CoverageStatus:
        """Return the coverage so far."""
        counted = self._points[self._points > 0]
        points = int(np.median(counted)) if len(counted) else 0
        cells = [(x, z, count) for (x, z), count in sorted(self._cells.items())]
        return CoverageStatus(points, cells, points >= ENOUGH_POINTS and len(cells) >= ENOUGH_CELLS)
