"""The map of what was walked while a calibration gathers."""

import numpy as np

from studio.engine.model.frames import CameraFrame
from studio.engine.model.joints import INDEX, JOINT_COUNT
from studio.live.calibration.coverage import ENOUGH_CELLS, ENOUGH_POINTS, Coverage
from studio.live.states import CoverageStatus


def frame(x, z, unseen=()):
    positions = np.tile(np.array([x, 0.0, z]), (JOINT_COUNT, 1))
    positions[[INDEX[name] for name in unseen]] = np.nan
    return CameraFrame("a", 0, 0, positions, np.ones(JOINT_COUNT))


def test_places_and_points_are_counted():
    coverage = Coverage()
    for _ in range(3):
        coverage.add(frame(-0.1, 2.2, unseen=["left_hand"]))
    coverage.add(frame(0.6, 3.0))
    coverage.add(frame(9.0, 9.0, unseen=["hips"]))
    assert coverage.status() == CoverageStatus(5, [(-1, 4, 3), (1, 6, 1)], False)


def test_enough_needs_points_and_places():
    spot, walk = Coverage(), Coverage()
    for i in range(ENOUGH_POINTS):
        spot.add(frame(0.0, 3.0))
        walk.add(frame(0.5 * (i % ENOUGH_CELLS), 3.0))
    assert not spot.status().enough
    assert walk.status().enough
    assert Coverage().status() == CoverageStatus(0, [], False)
