"""Lenses: pixels to rays and back, and pictures of other sizes."""

from dataclasses import replace

import numpy as np
import pytest

from studio.engine.model.cameras.lens import Lens

LENS = Lens(900.0, 905.0, 359.5, 639.5, 720, 1280, (0.08, -0.15, 0.001, -0.002, 0.05))


@pytest.mark.parametrize("lens", [LENS, replace(LENS, distortion=())])
def test_a_ray_leads_back_to_its_pixel(lens):
    pixels = np.random.default_rng(0).uniform([0, 0], [720, 1280], (50, 2))
    rays = lens.rays_of(pixels)
    points = np.concatenate([rays, np.ones((50, 1))], axis=1) * 2.5
    assert np.abs(lens.pixels_of(points) - pixels).max() < 1e-2


def test_a_smaller_picture_of_the_same_shape_has_the_same_rays():
    half = LENS.sized(360, 640)
    assert half is not None and (half.width, half.height) == (360, 640)
    centres = np.array([[0.5, 0.5], [100.5, 400.5]])  # of 2 x 2 pixels of the large picture
    assert half.rays_of((centres - 0.5) / 2) == pytest.approx(LENS.rays_of(centres), abs=1e-6)


@pytest.mark.parametrize("size", [(1280, 720), (720, 720)])
def test_a_turned_or_cropped_picture_has_no_known_lens(size):
    assert LENS.sized(*size) is None
