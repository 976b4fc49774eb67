"""Head orientation: its window follows the head, its arrows become a rotation, nothing seen is nothing told."""

import numpy as np
import pytest

from studio.engine.depth import DepthCamera
from studio.engine.geometry import matrices
from studio.engine.head import SIDE, HeadTracker, along_ray, head_window, oriented
from studio.engine.joints import INDEX, JOINT_COUNT

CAMERA = DepthCamera(365.0, 365.0, 255.5, 211.5, 512, 424)


def ball(place: np.ndarray) -> np.ndarray:
    """A depth image of a ball of 10 cm before a wall."""
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
    assert first is not None and first.shape == (2 * SIDE * SIDE + 2,)
    for other in windows[1:]:
        assert other is not None and np.abs(other - first)[: SIDE * SIDE].mean() < 0.06
    assert head_window(CAMERA, np.zeros((424, 512), np.uint16), middle) is None
    assert head_window(CAMERA, image, np.full(3, np.nan)) is None


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
