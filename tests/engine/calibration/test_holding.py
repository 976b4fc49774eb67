"""Calibrations from the part of a recording in which the cameras agree: what agrees is used, the rest is told."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from studio.engine.base.geometry import fit_rigid, make_transform, transform_points
from studio.engine.calibration.calibrate import calibrate
from studio.engine.calibration.cameras.pairs import LocalClock, make_track, sample
from studio.engine.calibration.cameras.refine import PlacedCamera
from studio.engine.calibration.quality.residuals import even_blocks, residuals
from studio.engine.model.calibration import Calibration
from tests.engine.calibration.scoring import transform_error
from tests.engine.calibration.synthetic import RIGS, Options, record
from tests.engine.calibration.test_recordings import PAIRS, kinect_frames

STUDY_2 = "Study_2_Kinect_0_Time_12_18_53_PM.csv"


def bumped(
    frames, at_s: float, metres: float, degrees: float, until_s: float = np.inf, camera: str = "camera_1"
):
    """The frames with one camera moved and turned at a time since its first frame."""
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


def spans_of(found: Calibration, frames, camera: str):
    """A camera's spans in seconds since the reference's first frame."""
    since_s = frames[found.reference][0].device_time_ns * 1e-9
    return [span.later(-since_s) for span in found.cameras[camera].disagrees]


@pytest.mark.parametrize(
    ("at_s", "metres", "degrees"), [(38.0, 0.03, 0.5), (28.0, 0.03, 0.5), (25.0, 0.15, 4.0)]
)
def test_what_agrees_is_used_and_the_moment_is_told(two, at_s, metres, degrees):
    """A move at half of the time, too: a fit through both halves would be off by half of the move in each."""
    frames, truth = two
    moved = bumped(frames, at_s, metres, degrees)
    found = calibrate(moved, must_hold="somewhere")
    assert not found.refused, found.reasons()
    camera = found.cameras["camera_1"]
    assert camera.verdict == "usable"
    (span,) = spans_of(found, moved, "camera_1")
    if span.to_s is None:  # else what came after the move was the longer part
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


def test_real_kinects_that_disagree_at_the_end(test_data: Path):
    path = test_data / "kinect2_pairs" / STUDY_2
    if not path.is_file():
        pytest.skip(f"no {path}")
    frames = kinect_frames(path)
    assert calibrate(frames).refused
    found = calibrate(frames, must_hold="somewhere")
    second = list(found.cameras)[1]
    camera = found.cameras[second]
    assert camera.verdict == "usable", camera.reasons
    (span,) = spans_of(found, frames, second)
    assert 99.0 < span.from_s < 100.5
    assert span.to_s is None
    assert camera.residual_median_mm < 15.0
    assert camera.residual_pairs > 20_000


def kabsch(source, target, share: float):
    """A trimmed rigid fit: the share of points with the least residuals decides."""
    T = fit_rigid(source, target, np.ones(len(source)))
    for _ in range(20):
        off = np.linalg.norm(transform_points(T, source) - target, axis=1)
        T = fit_rigid(source, target, (off <= np.quantile(off, share)).astype(float))
    return T


@pytest.mark.parametrize("name", [*PAIRS, STUDY_2])
def test_no_trimmed_kabsch_does_better_on_the_same_blocks(test_data: Path, name: str):
    """A baseline apart from the product: fitted on even blocks, its lag searched, scored on odd blocks, as we are."""
    path = test_data / "kinect2_pairs" / name
    if not path.is_file():
        pytest.skip(f"no {path}")
    frames = kinect_frames(path)
    found = list(calibrate(frames).cameras.values())
    a, b = (make_track(mine) for mine in frames.values())
    offset_s = (found[1].clock.stage_ns(b.epoch_ns) - a.epoch_ns) * 1e-9
    times = np.arange(0.0, a.times_s[-1], 1 / 15)
    even, here, best = even_blocks(times), sample(a, times)[0], (np.inf, None)
    for clock in [LocalClock(offset_s + lag_s) for lag_s in np.arange(-0.06, 0.061, 0.02)]:
        there = sample(b, clock.device_s(times))[0]
        both = np.isfinite(here).all(axis=2) & np.isfinite(there).all(axis=2) & even[:, None]
        T = kabsch(there[both], here[both], 0.8)
        off = np.median(np.linalg.norm(transform_points(T, there[both]) - here[both], axis=1))
        best = min(best, (off, PlacedCamera(T, clock)), key=lambda one: one[0])
    placed = (PlacedCamera(np.eye(4), LocalClock()), best[1])
    baseline = residuals((a, b), placed, times[~even], np.zeros((~even).sum(), dtype=bool), 0.0)
    assert found[1].residual_median_mm <= baseline.median_m * 1e3 * 1.04
