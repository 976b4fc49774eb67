"""The thesis's four figures on curves with a known answer."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from studio.engine.metrics import thesis

RATE = 60.0
TIME = np.arange(600) / RATE


def curve(x, y=None, z=None):
    """One wrist: shape (1, frame_count, 3)."""
    zero = np.zeros(len(x))
    return np.stack([x, zero if y is None else y, zero if z is None else z], axis=1)[None]


def test_absolute_difference_is_a_mean_over_axes():
    a = curve(np.zeros(600))
    assert thesis.absolute_difference_cm(a + np.array([0.06, -0.03, 0.0]), a) == pytest.approx(3.0, abs=1e-9)


def test_shortest_distance_ignores_time_and_interpolates():
    """A point that runs beside a straight path of few vertices is as far as it is beside it."""
    path = curve(np.linspace(0, 1, 600))
    beside = curve(np.linspace(0.9, 0.1, 600), y=np.full(600, 0.04))
    assert thesis.shortest_distance_cm(beside, path) == pytest.approx(4.0, abs=1e-9)


@settings(max_examples=30, deadline=None)
@given(seed=st.integers(0, 2**16))
def test_distance_to_path_equals_the_search_of_every_segment(seed):
    rng = np.random.default_rng(seed)
    path, points = np.cumsum(rng.normal(0, 0.1, (40, 3)), axis=0), rng.normal(0, 1.0, (20, 3))
    fast = thesis.distance_to_path(points, path)
    samples = np.linspace(0, 1, 501)[:, None, None]
    dense = (path[:-1] + samples * np.diff(path, axis=0)).reshape(-1, 3)
    slow = np.linalg.norm(points[:, None] - dense[None], axis=2).min(axis=1)
    assert (fast <= slow + 1e-12).all()
    assert np.abs(fast - slow).max() < 2e-3


def test_spikes_are_counted_once_each():
    x = np.zeros(600)
    x[100] = x[300] = 0.11  # two blips of a frame
    x[450:] = 0.15  # a step
    assert thesis.spike_count(x, RATE) == 3
    assert thesis.spike_count(0.9 * x[:400], RATE) == 0  # 9.9 cm is no spike
    assert thesis.spike_count(TIME * 0.74, RATE) == 0  # 10 cm in 4/30 s is 0.75 m/s
    assert thesis.spike_count(TIME * 0.76, RATE) == 1


def test_spike_difference_is_captured_minus_reference_per_curve():
    x = np.zeros(600)
    x[100] = x[300] = 0.2
    assert thesis.spike_difference(curve(x), curve(np.zeros(600)), RATE) == pytest.approx(2 / 3)
    assert thesis.spike_difference(curve(np.zeros(600)), curve(x), RATE) == pytest.approx(-2 / 3)


def test_opposite_sines_deviate_in_every_half_wave():
    """0.5 Hz, 20 cm: |x''| is over 1 m/s2 for 0.67 s around each of the 10 extrema in 10 s."""
    wave = 0.2 * np.sin(2 * np.pi * 0.5 * TIME)
    assert thesis.deviation_count(wave, -wave, RATE) == 10
    assert thesis.deviation_count(wave, wave, RATE) == 0
    assert thesis.deviation_count(wave, np.zeros(600), RATE) == 0
    assert thesis.deviations(curve(wave), curve(-wave), RATE) == pytest.approx(10 / 3)


def test_short_opposite_curvature_is_no_deviation():
    """8 Hz is gone after the 3 Hz filter."""
    wave = 0.02 * np.sin(2 * np.pi * 8 * TIME)
    assert thesis.deviation_count(wave, -wave, RATE) == 0
