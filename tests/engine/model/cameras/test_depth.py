"""Depth images: points in the camera frame, with and without distortion."""

import numpy as np
import pytest

from studio.engine.model.cameras.depth import DepthCamera, points


def test_a_wall_seen_by_a_pinhole_camera():
    camera = DepthCamera(100.0, 110.0, 3.0, 2.0, 8, 6)
    depth = np.full((6, 8), 2000, np.uint16)
    depth[0, 0] = 0
    seen = points(camera, depth)
    assert seen[2, 3] == pytest.approx([0, 0, 2])
    assert seen[5, 7] == pytest.approx([2 * 4 / 100, 2 * 3 / 110, 2])
    assert not seen[0, 0].any()


def test_undistorted_rays_distort_back_to_their_pixels():
    k1, k2, p1, p2, k3 = coefficients = (0.15, -0.2, 0.001, -0.002, 0.05)
    camera = DepthCamera(250.0, 251.0, 160.0, 144.0, 320, 288, coefficients)
    x, y = np.moveaxis(camera.rays.astype(float), 2, 0)
    r2 = x * x + y * y
    radial = 1 + k1 * r2 + k2 * r2**2 + k3 * r2**3
    columns = 250 * (x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x)) + 160
    rows = 251 * (y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y) + 144
    expected = np.meshgrid(np.arange(320), np.arange(288))
    assert np.abs(columns - expected[0]).max() < 1e-2
    assert np.abs(rows - expected[1]).max() < 1e-2


def test_points_are_seen_at_their_pixels_where_the_lens_reaches():
    lens = (0.547940, -0.020971, 2.0558e-5, -7.2104e-5, -0.002652, 0.889679, 0.086130, -0.013910)
    camera = DepthCamera(252.3, 252.4, 256.1, 255.7, 512, 512, lens)  # 120 degrees wide
    seen = points(camera, np.full((512, 512), 2000, np.uint16))
    assert np.isfinite(seen).all()
    reached = camera.rays.any(axis=2)
    assert 0.9 < reached.mean() < 0.97 and not reached[0, 0] and reached[100:400, 100:400].all()
    pixels = np.stack(np.meshgrid(np.arange(512), np.arange(512)), axis=2)
    assert np.abs(camera.pixels_of(seen[reached]) - pixels[reached]).max() < 0.51
    inner = (slice(100, 400), slice(100, 400))
    assert np.abs(camera.pixels_of(seen[inner]) - pixels[inner]).max() < 1e-2
