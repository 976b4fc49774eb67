"""Phones in different orientations: one in portrait, the others in landscape."""

from dataclasses import replace
from pathlib import Path

import numpy as np

from studio.engine.calibration.views.calibrate import calibrate_views
from studio.engine.calibration.views.seen.view import View
from tests.engine.calibration.views.recordings import error_of, landmarks_m, truth_of, walk

WALK = "walk_4_cameras"
WIDER = 0.5
"""Focal length of a phone in landscape, as a share: the whole body must fit in its lower picture."""


def in_landscape(view: View) -> View:
    """The same place and direction, with a wider lens and a picture in landscape."""
    middle = np.array([view.width, view.height]) / 2
    pixels = (view.pixels - middle) * WIDER + middle[::-1]
    return replace(view, pixels=pixels, width=view.height, height=view.width)


def test_portrait_and_landscape_are_calibrated_together(test_data: Path) -> None:
    first, second, third, fourth = walk(test_data, WALK, every=2)
    assert first.height > first.width
    result = calibrate_views([first, in_landscape(second), third, in_landscape(fourth)])
    assert result.verdict != "refused", result.reasons
    found = error_of(result, truth_of(test_data, WALK), landmarks_m(test_data, WALK))
    assert found.turn_deg < 1.0 and found.place_m < 0.08
    focal = [camera.lens.fx for camera in result.cameras.values()]
    assert np.allclose(np.array(focal[1::2]) / np.array(focal[::2]), WIDER, rtol=0.05)
