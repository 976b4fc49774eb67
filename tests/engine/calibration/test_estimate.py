"""The estimate of the cameras' agreement during a walk."""

import pytest

from studio.engine.calibration.calibrate import calibrate
from studio.engine.calibration.estimate import estimate_residuals
from tests.engine.calibration.synthetic import RIGS, record


@pytest.fixture(scope="module")
def walk():
    """Frames of two cameras, and the stage times of their first frames, known up to a device's latency."""
    frames, truth = record(0, RIGS[2])
    starts_ns = {
        name: mine[0].device_time_ns
        - round((truth.offset_s[name] + (0.05 if name == "camera_1" else 0.0)) * 1e9)
        for name, mine in frames.items()
    }
    return frames, starts_ns


def test_it_comes_near_to_the_calibration(walk):
    frames, starts_ns = walk
    found = estimate_residuals(frames, starts_ns, "camera_0")
    assert found.keys() == {"camera_1"}
    kept = calibrate(frames, reference="camera_0").cameras["camera_1"].residual_median_mm
    assert found["camera_1"].median_m * 1e3 == pytest.approx(kept, rel=0.3)


def test_two_people_are_seen_to_disagree(walk):
    frames, starts_ns = walk
    others = record(1, RIGS[2], walking=False)[0]["camera_1"]
    found = estimate_residuals({**frames, "camera_1": others}, starts_ns, "camera_0")
    assert found["camera_1"].median_m > 0.1


def test_nothing_is_said_of_too_little(walk):
    frames, starts_ns = walk
    few = {name: mine[:20] for name, mine in frames.items()}
    assert estimate_residuals(few, starts_ns, "camera_0")["camera_1"].median_m is None
    assert estimate_residuals({**frames, "camera_1": []}, starts_ns, "camera_0")["camera_1"].pairs == 0
    assert estimate_residuals({"camera_1": frames["camera_1"]}, starts_ns, "camera_0") == {}
