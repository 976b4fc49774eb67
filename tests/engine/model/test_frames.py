"""Clock models."""

import numpy as np
import pytest

from studio.engine.model.frames import ClockModel


def test_offset_and_drift():
    clock = ClockModel(offset_ns=-1000, drift_ppm=100.0, reference_ns=2_000_000_000)
    assert clock.stage_ns(2_000_000_000) == 1_999_999_000
    assert clock.stage_ns(12_000_000_000) == 12_000_000_000 - 1000 + 1_000_000
    assert ClockModel().stage_ns(7) == 7


def test_seconds_agree_with_nanoseconds():
    clock = ClockModel(offset_ns=150_000_000, drift_ppm=-80.0, reference_ns=5_000_000_000)
    device_s = np.array([0.0, 5.0, 3600.0])
    expected = [clock.stage_ns(round(t * 1e9)) * 1e-9 for t in device_s]
    assert clock.stage_s(device_s) == pytest.approx(expected, abs=1e-6)


def test_nanoseconds_stay_exact_over_years():
    clock = ClockModel(offset_ns=3)
    assert clock.stage_ns(2**60 + 1) == 2**60 + 4
