"""The thesis's four figures on curves with a known answer."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from studio.engine.metrics.figures import thesis
from studio.engine.metrics.reference.matching import match
from studio.engine.model.joints import INDEX
from tests.engine.metrics.cases import dance, poses_of, reference_of, shifted

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
    """A point that moves parallel to a straight path of few vertices is as far off as the two are apart."""
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
    """8 Hz is removed by the 3 Hz filter."""
    wave = 0.02 * np.sin(2 * np.pi * 8 * TIME)
    assert thesis.deviation_count(wave, -wave, RATE) == 0


@settings(max_examples=30, deadline=None)
@given(seed=st.integers(0, 2**16), shift=st.tuples(*[st.floats(-0.5, 0.5)] * 3))
def test_a_shift_costs_its_mean_over_axes_and_its_length_beside_a_straight_path(seed, shift):
    rng = np.random.default_rng(seed)
    direction = rng.normal(size=3)
    direction /= np.linalg.norm(direction)
    path = (np.linspace(-5, 5, 400)[:, None] * direction)[None]
    across = np.array(shift) - (np.array(shift) @ direction) * direction
    assert thesis.absolute_difference_cm(path + shift, path) == pytest.approx(
        100 * np.abs(shift).mean(), abs=1e-9
    )
    middle = slice(100, 300)  # the ends of the path are out of reach
    assert thesis.shortest_distance_cm(path[:, middle] + shift, path) == pytest.approx(
        100 * np.linalg.norm(across), abs=1e-7
    )


@settings(max_examples=30, deadline=None)
@given(amplitude=st.floats(0.01, 0.5), phase=st.floats(0, 6.28), periods=st.integers(1, 6))
def test_sines_differ_by_the_mean_of_their_rectified_difference(amplitude, phase, periods):
    """Over whole periods, against rest: a sum that is known sample by sample."""
    wave = amplitude * np.sin(2 * np.pi * periods * np.arange(600) / 600 + phase)
    expected = 100 * np.abs(wave).mean() / 3
    assert thesis.absolute_difference_cm(curve(wave), curve(np.zeros(600))) == pytest.approx(
        expected, abs=1e-9
    )


@settings(max_examples=30, deadline=None)
@given(
    places=st.lists(st.integers(2, 28), min_size=0, max_size=6, unique=True),
    heights=st.lists(st.floats(0.101, 0.9), min_size=6, max_size=6),
    rate=st.sampled_from([30.0, 60.0, 120.0]),
)
def test_known_spikes_are_counted(places, heights, rate):
    """Spikes a third of a second apart: each is one interval, whatever its height."""
    x = np.zeros(round(10.5 * rate))
    for place, height in zip(places, heights, strict=False):
        x[round(place * rate / 3)] = height
    assert thesis.spike_count(x, rate) == len(places)
    assert thesis.spike_count(np.sign(x) * 0.0999, rate) == 0


@settings(max_examples=20, deadline=None)
@given(frequency=st.sampled_from([0.4, 0.5, 0.8, 1.0]), rate=st.sampled_from([30.0, 60.0, 120.0]))
def test_known_concavities_are_counted(frequency, rate):
    """Opposite sines of 20 cm: each half wave is one deviation, over 0.2 s long and over 1 m/s2 in its middle."""
    time = np.arange(round(10 * rate)) / rate
    wave = 0.2 * np.cos(2 * np.pi * frequency * (time + 0.25 / frequency))
    expected = round(10 * 2 * frequency)
    assert thesis.deviation_count(wave, -wave, rate) == expected
    assert thesis.deviation_count(wave, 0.5 * wave, rate) == 0


def test_the_nearest_sample_is_looked_for_on_each_axis_alone():
    """x matches exactly at another time; y is 2 cm above all of the reference's; z is midway between two samples."""
    reference = curve(np.arange(600) * 0.01, z=np.repeat([0.0, 0.06], 300))
    solve = curve(np.arange(600)[::-1] * 0.01, y=np.full(600, 0.02), z=np.full(600, 0.03))
    assert thesis.nearest_sample_cm(solve, reference) == pytest.approx((0.0 + 2.0 + 3.0) / 3, abs=1e-9)


@pytest.mark.parametrize("joint", ["wrist", "elbow", "shoulder"])
def test_figures_of_a_joint_are_relative_to_the_chest(joint):
    """The whole body is 1 m off, the joints 3 cm along x: 1 cm in the mean over axes."""
    truth = dance(TIME)
    shifts = {f"{side}_{joint}": [0.03, 0.0, 0.0] for side in ("left", "right")}
    moved = shifted(truth, shifts) + np.array([1.0, 0.0, 0.0])
    found = thesis.figures(match(poses_of(TIME, moved), reference_of(TIME, truth)), joint)
    assert list(found) == list(thesis.FIGURES)
    assert found["absolute_difference_cm"] == pytest.approx(1.0, abs=1e-9)
    assert found["spike_difference"] == 0.0 and found["deviations"] == 0.0
    assert found["shortest_distance_cm"] <= 3.0 and found["nearest_sample_cm"] <= 1.0


def test_without_a_chest_there_are_no_curves():
    truth = dance(TIME)
    truth[:, INDEX["chest"]] = np.nan
    found = thesis.figures(match(poses_of(TIME, dance(TIME)), reference_of(TIME, truth)))
    assert found == dict.fromkeys(thesis.FIGURES)
