"""The solve's own 90 % balls against errors of known size."""

from dataclasses import replace

import numpy as np
import pytest

from studio.engine.metrics.evaluate import evaluate
from studio.engine.metrics.figures.honesty import uncertainty_coverage, uncertainty_median_ratio
from studio.engine.metrics.reference.matching import match
from studio.engine.model.joints import INDEX, OUTPUT_OF_CANONICAL_INDEX
from tests.engine.metrics.cases import dance, poses_of, reference_of, shifted

TIME = np.arange(300) / 60.0


def with_radius(poses, radius_mm):
    """The poses with this radius for every joint; its shape broadcasts to (frame_count, 21)."""
    uncertainty = poses.uncertainty_mm.copy()
    uncertainty[:, OUTPUT_OF_CANONICAL_INDEX] = radius_mm
    return replace(poses, uncertainty_mm=uncertainty)


def test_errors_inside_and_outside_are_counted():
    """Three of fifteen joints are 50 mm off, twelve 10 mm; balls of 20 mm contain those twelve."""
    truth = dance(TIME)
    moved = shifted(
        truth + np.array([0.006, 0.0, 0.008]),
        {name: [0.024, 0.0, 0.032] for name in ("head", "neck", "hips")},
    )
    matched = match(with_radius(poses_of(TIME, moved), 20.0), reference_of(TIME, truth))
    assert uncertainty_coverage(matched) == pytest.approx(12 / 15)
    assert uncertainty_median_ratio(matched) == pytest.approx(2.0)


def test_a_normal_error_has_nine_tenths_inside_its_ball():
    """The radius is 2.5003 deviations per axis; the median error is 1.5382 deviations."""
    truth, noise = dance(TIME), np.random.default_rng(2).normal(0, 0.01, (300, 21, 3))
    matched = match(with_radius(poses_of(TIME, truth + noise), 25.003), reference_of(TIME, truth))
    assert uncertainty_coverage(matched) == pytest.approx(0.9, abs=0.01)
    assert uncertainty_median_ratio(matched) == pytest.approx(25.003 / 15.382, rel=0.02)


def test_radii_that_are_not_known_do_not_count():
    truth = dance(TIME)
    moved = truth + np.array([0.01, 0.0, 0.0])
    radius = np.full((300, 21), 20.0)
    radius[:, INDEX["left_wrist"]] = np.nan
    matched = match(with_radius(poses_of(TIME, moved), radius), reference_of(TIME, truth))
    assert uncertainty_coverage(matched) == 1.0
    unknown = evaluate(poses_of(TIME, moved), reference_of(TIME, truth))
    assert unknown["uncertainty_coverage"] is None and unknown["uncertainty_median_ratio"] is None


def test_the_take_is_aligned_first():
    truth = dance(TIME)
    figures = evaluate(
        with_radius(poses_of(TIME, truth + np.array([1.0, 2.0, 0.0])), 1.0), reference_of(TIME, truth)
    )
    assert figures["uncertainty_coverage"] == 1.0
