"""Joints show how correlated noise is from frame to frame, whatever its size."""

import numpy as np
import pytest

from studio.engine.model.joints import INDEX, JOINT_COUNT
from studio.engine.whole_take.finish.measurements import ALIKE, SHARE, NoiseScale, measure, posture_share

FRAMES = 900


def scale_of(memory: float, sigma_m: float) -> NoiseScale:
    """Estimate for noise that is the same in all directions, of which this share is kept from frame to frame."""
    rng = np.random.default_rng(7)
    noise = rng.normal(0.0, sigma_m, (FRAMES, 1, JOINT_COUNT, 3))
    for k in range(1, FRAMES):
        noise[k] = memory * noise[k - 1] + np.sqrt(1.0 - memory**2) * noise[k]
    body = np.tile([0.0, 3.0, 1.0], (FRAMES, JOINT_COUNT, 1))
    sure, now = np.full((FRAMES, 1, JOINT_COUNT), 0.95), np.zeros((FRAMES, 1))
    scale = NoiseScale(1)
    scale.add(measure(body[:, None] + noise, sure, now, np.zeros((1, 3)), np.full(1, np.nan)), body, 1)
    return scale


@pytest.mark.parametrize("sigma_m", [0.005, 0.02])
def test_white_noise_is_told_from_a_depth_cameras(sigma_m):
    assert scale_of(0.0, sigma_m).alike() == pytest.approx(0.2, abs=0.03)
    assert scale_of(0.8, sigma_m).alike() == pytest.approx(1.0, abs=0.15)
    assert scale_of(0.98, sigma_m).alike() == 1.0


def test_nothing_is_told_where_nothing_was_seen():
    assert NoiseScale(2).alike() == 1.0


def test_noise_along_the_ray_is_told_apart_from_noise_across_it():
    """Joints 3.16 m away: usually 2.1 times as far off along the ray, 16 and 10 mm for an elbow."""
    ray = np.hypot(3.0, 1.0)
    weighing, spread = (found[0, :, INDEX["left_elbow"]] for found in scale_of(0.0, 0.015).factors())
    usual_m = np.array([0.0016 * ray**2, 0.0032 * ray])
    true = (0.015 / usual_m) ** 2
    assert spread == pytest.approx(true, rel=0.2)
    assert weighing == pytest.approx(true * 2.0 / ALIKE * SHARE, rel=0.2)


def test_the_usual_posture_counts_against_as_many_independent_frames():
    assert posture_share(1.0) == 1.0
    assert posture_share(0.2) == pytest.approx(0.2 / 9.0)
    assert 0.0 < posture_share(0.05) < posture_share(0.2) < posture_share(0.5) < 1.0
