"""Head orientation: its window follows the head, its arrows become a rotation, an unseen head gives no result."""

import numpy as np
import pytest

from studio.engine.base.geometry import matrices
from studio.engine.model.cameras.depth import DepthCamera
from studio.engine.model.joints import INDEX, JOINT_COUNT
from studio.engine.seeing.head import ABOUT, CHANNELS, SIDE, HeadTracker, along_ray, head_window, oriented

CAMERA = DepthCamera(365.0, 365.0, 255.5, 211.5, 512, 424)


def ball(place: np.ndarray) -> np.ndarray:
    """A depth image of a ball of 10 cm in front of a wall."""
    y, x = np.mgrid[:424, :512]
    right, down = (x - 255.5) / 365 * place[2] - place[0], (y - 211.5) / 365 * place[2] - place[1]
    deep = 0.01 - right**2 - down**2
    return np.where(deep > 0, 1000 * (place[2] - np.sqrt(np.maximum(deep, 0))), 4000).astype(np.uint16)


def test_the_window_hangs_from_the_top_of_the_head_wherever_the_joint_is() -> None:
    middle = np.array([0.1, -0.1, 2.0])
    image = ball(middle)
    windows = [head_window(CAMERA, image, middle + np.array([dx, 0.09 + dy, dz])) for dx, dy, dz in
               ((0, 0, 0), (0.03, 0.02, 0.02), (-0.03, -0.02, -0.02))]  # fmt: skip
    first = windows[0]
    assert (
        first is not None and first.samples.shape == (SIDE, SIDE, CHANNELS) and first.about.shape == (ABOUT,)
    )
    for other in windows[1:]:
        assert other is not None and np.abs(other.samples - first.samples)[..., 0].mean() < 0.06
    assert head_window(CAMERA, np.zeros((424, 512), np.uint16), middle) is None
    assert head_window(CAMERA, image, np.full(3, np.nan)) is None
    assert head_window(CAMERA, np.full((424, 512), 2000, np.uint16), middle) is None  # a wall


def test_a_head_aside_looks_like_one_straight_ahead() -> None:
    def window(place: np.ndarray) -> np.ndarray:
        along = CAMERA.rays.astype(float)
        rays = np.concatenate([along, np.ones((*along.shape[:2], 1))], axis=2)
        a, b = (rays**2).sum(axis=2), rays @ place
        inside = b**2 - a * (place @ place - 0.1**2)
        z = np.where(inside > 0, (b - np.sqrt(np.maximum(inside, 0))) / a, 4.0)
        seen = head_window(CAMERA, np.rint(1000 * z).astype(np.uint16), place + np.array([0.0, 0.05, 0.0]))
        assert seen is not None
        np.testing.assert_allclose(seen.R_camera_window[:, 2], place / np.linalg.norm(place), atol=0.03)
        return seen.samples

    ahead = window(np.array([0.0, 0.0, 2.0]))
    for place in ([0.9, -0.7, 1.6], [-0.8, 0.3, 1.8]):
        aside = window(np.array(place))
        full = (ahead[..., 0] > 0.99) & (aside[..., 0] > 0.99)
        assert full.sum() > 250 and np.abs(aside - ahead)[full][:, 1].max() < 0.5  # a step of depth is 0.02


def test_arrows_become_a_rotation() -> None:
    seen = oriented(np.array([0.0, 0.0, -0.95]), np.array([0.0, -0.9, 0.1]))
    assert seen is not None and seen.confidence == pytest.approx(np.hypot(0.9, 0.1))
    turn = matrices(np.array(seen.wxyz))
    np.testing.assert_allclose(turn @ [0, -1, 0], [0, 0, -1], atol=1e-9)  # the face looks into the camera
    np.testing.assert_allclose(turn @ [0, 0, 1], [0, -1, 0], atol=1e-9)
    assert oriented(np.array([0.0, 0.0, -0.2]), np.array([0.0, -0.9, 0.0])) is None
    assert oriented(np.array([0.0, 0.0, -0.9]), np.array([0.0, 0.0, -0.9])) is None


def test_the_ray_is_where_the_z_axis_goes() -> None:
    place = np.array([0.4, -0.3, 2.0])
    turn = along_ray(place)
    np.testing.assert_allclose(turn @ [0, 0, 1], place / np.linalg.norm(place), atol=1e-12)
    np.testing.assert_allclose(turn.T @ turn, np.eye(3), atol=1e-12)
    assert np.linalg.det(turn) == pytest.approx(1.0)


def test_an_image_without_a_head_tells_nothing() -> None:
    tracker = HeadTracker(CAMERA)
    positions, confidence = np.full((JOINT_COUNT, 3), np.nan), np.zeros(JOINT_COUNT)
    assert tracker.update(np.zeros((424, 512), np.uint16), positions, confidence, 0) is None
    positions[INDEX["head"]], confidence[INDEX["head"]] = [0.0, 0.0, 2.0], 0.9
    assert tracker.update(np.zeros((424, 512), np.uint16), positions, confidence, 33_000_000) is None
