"""The view from which all of the stage is seen."""

import numpy as np
import pytest

from studio.web.framing import axes_towards, fit
from studio.web.viewpoint import FOV_RAD, whole_stage


def in_picture(points: np.ndarray, look, aspect: float) -> np.ndarray:
    """Places in the picture, -1 to 1 in both directions, shape (N, 2)."""
    axes = axes_towards(look.position_m - look.target_m)
    places = (points - look.position_m) @ axes.T
    assert (places[:, 2] > 0).all()
    return places[:, :2] / places[:, 2:] / np.tan(FOV_RAD / 2) / [aspect, 1.0]


@pytest.mark.parametrize("aspect", [0.6, 1.0, 1.78, 2.4])
def test_performer_and_cameras_are_in_the_picture(aspect: float) -> None:
    cameras = np.array([[3.4, 0.2, 1.0], [-2.0, -2.9, 1.6], [-1.8, 2.8, 1.0]])
    look = whole_stage(cameras, np.array([0.4, -0.3, 0.9]), aspect)
    places = in_picture(np.concatenate([cameras, [[0.4, -0.3, 1.8], [0.4, -0.3, 0.0]]]), look, aspect)
    assert (np.abs(places) < 1.0).all()


def test_the_picture_is_no_larger_than_it_needs_to_be() -> None:
    rng = np.random.default_rng(2)
    points = rng.normal(0.0, 1.0, (50, 3))
    look = fit(points, np.array([0.3, -1.0, 0.4]), fov_rad=FOV_RAD, aspect=1.5, margin=1.0)
    places = in_picture(points, look, 1.5)
    assert np.abs(places).max() == pytest.approx(1.0)
