"""Calibrations from the part of a recording in which the cameras agree: this part is used, the rest is reported."""

import json
from dataclasses import replace

import numpy as np
import pytest

from studio.engine.base.geometry import make_transform, transform_points
from studio.engine.calibration.calibrate import calibrate
from studio.engine.model.calibration import Calibration
from tests.engine.calibration.scoring import spans_of, transform_error
from tests.engine.calibration.synthetic import RIGS, Options, record


def bumped(
    frames, at_s: float, metres: float, degrees: float, until_s: float = np.inf, camera: str = "camera_1"
):
    """The frames with one camera moved and turned at a time, counted from its first frame."""
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    T = make_transform(np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]]), np.array([metres, 0, 0]))
    first_ns = frames[camera][0].device_time_ns
    mine = [
        replace(frame, positions=transform_points(T, frame.positions))
        if at_s <= (frame.device_time_ns - first_ns) * 1e-9 < until_s
        else frame
        for frame in frames[camera]
    ]
    return {**frames, camera: mine}


@pytest.fixture(scope="module")
def two():
    return record(100, RIGS[2], Options(duration_s=50))


@pytest.mark.parametrize(
    ("at_s", "metres", "degrees"),
    [(38.0, 0.03, 0.5), (25.0, 0.15, 4.0), pytest.param(28.0, 0.03, 0.5, marks=pytest.mark.long)],
)
def test_what_agrees_is_used_and_the_moment_is_told(two, at_s, metres, degrees):
    """Includes a move at half of the time: a fit through both halves would be off by half of the move in each."""
    frames, truth = two
    moved = bumped(frames, at_s, metres, degrees)
    found = calibrate(moved, must_hold="somewhere")
    assert not found.refused, found.reasons()
    camera = found.cameras["camera_1"]
    assert camera.verdict == "usable"
    (span,) = spans_of(found, moved, "camera_1")
    if span.to_s is None:  # else the part after the move was the longer one
        assert abs(span.from_s - at_s) < 0.3
        assert transform_error(found, truth.T_stage_camera, "camera_1").rms_m < 0.01
        assert any(
            f"no longer agrees with the other cameras from {span.from_s:.1f} s on" in r
            for r in camera.reasons
        )
    else:
        assert span.from_s < 1.0
        assert abs(span.to_s - at_s) < 0.3
    assert not found.cameras["camera_0"].disagrees
    again = Calibration.from_json(json.loads(json.dumps(found.to_json())))
    assert spans_of(again, moved, "camera_1")[0].from_s == pytest.approx(span.from_s, abs=1e-3)


def test_of_three_cameras_the_one_that_moved_is_named():
    frames, truth = record(101, RIGS[3], Options(duration_s=50))
    moved = bumped(frames, 35.0, 0.08, 2.0, camera="camera_2")
    found = calibrate(moved, must_hold="somewhere")
    assert not found.refused, found.reasons()
    assert [name for name, camera in found.cameras.items() if camera.disagrees] == ["camera_2"]
    (span,) = spans_of(found, moved, "camera_2")
    assert span.named
    assert abs(span.from_s - 35.0) < 0.3
    assert transform_error(found, truth.T_stage_camera, "camera_2").rms_m < 0.01


def test_what_passes_is_left_out_of_a_walk_but_no_move_that_stays(two):
    frames, truth = two
    passing = calibrate(bumped(frames, 15.0, 0.3, 0.0, until_s=21.0), must_hold="at_end")
    assert not passing.refused, passing.reasons()
    (span,) = spans_of(passing, frames, "camera_1")
    assert abs(span.from_s - 15.0) < 0.3
    assert abs(span.to_s - 21.0) < 0.3
    assert transform_error(passing, truth.T_stage_camera, "camera_1").rms_m < 0.01
    assert calibrate(bumped(frames, 38.0, 0.08, 2.0), must_hold="at_end").refused


def test_less_than_twenty_seconds_of_agreement_is_refused():
    frames, _ = record(102, RIGS[2], Options(duration_s=34))
    assert calibrate(bumped(frames, 17.0, 0.1, 3.0), must_hold="somewhere").refused


def test_cameras_that_stay_lose_nothing(two):
    frames, _ = two
    assert calibrate(frames, must_hold="somewhere").to_json() == calibrate(frames).to_json()
