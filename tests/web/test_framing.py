"""The view from which all of the stage is seen."""

import numpy as np
import pytest

from studio.web.scene.framing import axes_towards, fit
from studio.web.scene.viewpoint import FOV_RAD, performer, whole_motion, whole_stage


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


@pytest.mark.parametrize("aspect", [0.9, 1.78, 2.4])
def test_a_whole_motion_is_in_the_picture_and_fills_it(aspect: float) -> None:
    rng = np.random.default_rng(3)
    walk = np.linspace([-1.5, 0.5, 0.0], [2.0, -0.5, 0.0], 40)
    joints = (walk[:, None] + rng.uniform([-0.3, -0.3, 0.05], [0.3, 0.3, 1.7], (40, 20, 3))).reshape(-1, 3)
    joints[7] = np.nan
    look = whole_motion(joints, aspect)
    places = np.abs(in_picture(joints[np.isfinite(joints).all(axis=1)], look, aspect))
    assert 0.75 < places.max() < 1.0
    assert (np.abs(in_picture(np.array([[0.0, 0.0, 0.0]]), look, aspect)) < 1.0).all()


@pytest.mark.parametrize("direction", [(0.3, -1.0, 0.2), (1.0, 0.0, 0.4), (0.0, 0.0, 1.0), (0.0, 0.0, 0.0)])
def test_a_performer_who_is_followed_fills_the_picture(direction: tuple[float, float, float]) -> None:
    hips = np.array([2.0, -1.0, 0.9])
    look = performer(hips, np.array(direction), 2.0)
    ends = in_picture(np.array([[2.0, -1.0, 0.0], [2.0, -1.0, 1.75]]), look, 2.0)
    assert (np.abs(ends) < 1.0).all() and abs(ends[1, 1] - ends[0, 1]) > 1.1  # of the 2 from edge to edge
