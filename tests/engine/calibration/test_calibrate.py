"""A stage calibrated from simulated cameras with known truth, and from wrong inputs."""

import json
from dataclasses import replace

import numpy as np
import pytest

from studio.engine.base.errors import CalibrationError
from studio.engine.calibration.calibrate import calibrate, with_performer
from studio.engine.model.calibration import Calibration
from studio.engine.model.joints import INDEX, MIRROR
from tests.engine.calibration.scoring import clock_error_ms, stage_error, transform_error
from tests.engine.calibration.synthetic import RIGS, Options, offsets, record
from tests.refused import refused


@pytest.fixture(scope="module")
def two_cameras():
    return record(7, RIGS[2])


@pytest.fixture(scope="module")
def two_calibrated(two_cameras):
    return calibrate(two_cameras[0])


@pytest.mark.parametrize(
    ("rig", "seed"), [(2, 1), (4, 4), *(pytest.param(n, n, marks=pytest.mark.long) for n in (2, 3))]
)
def test_the_noise_contract_is_undone(rig, seed):
    frames, truth = record(seed, RIGS[rig])
    found = calibrate(frames)
    assert not found.refused, found.reasons()
    for name in list(frames)[1:]:
        error = transform_error(found, truth.T_stage_camera, name)
        assert error.rms_m < 0.008
        assert error.angle_deg < 0.2
        for stage_s in (2.0, 30.0):
            offset = truth.offset_s[name] + 100.0
            zero_s = stage_s + 100.0  # the stage clock is camera_0's, which starts at 100 s
            found_ms = clock_error_ms(
                found, name, zero_s, offset - 100.0 * (1 + truth.drift[name]), truth.drift[name]
            )
            assert found_ms < 6.0
    assert found.cameras["camera_0"].depth_bias_m == pytest.approx(0.03, abs=0.005)


def test_without_noise_the_truth_comes_out():
    quiet = Options(noise=0.0, spikes=False, dropouts=False, swaps=False, hidden=False)
    frames, truth = record(5, RIGS[3], quiet)
    found = calibrate(frames)
    for name in ("camera_1", "camera_2"):
        error = transform_error(found, truth.T_stage_camera, name)
        assert error.rms_m < 0.002
        assert error.angle_deg < 0.05
        assert found.cameras[name].residual_median_mm < 5
        assert found.cameras[name].verdict == "good"


def test_stage_stands_on_the_floor_under_the_tpose(two_cameras, two_calibrated):
    _, truth = two_cameras
    tilt, height, turn = stage_error(two_calibrated, truth.T_stage_camera["camera_0"])
    assert tilt < 1.0
    assert abs(height) < 0.03
    assert abs(turn) < 3.0
    camera = two_calibrated.cameras["camera_0"].T_stage_camera
    np.testing.assert_allclose(camera[:3, 3], RIGS[2][0][:3, 3], atol=0.1)


def test_bones_are_as_long_as_they_are(two_calibrated):
    performer = two_calibrated.performer
    found, true = np.linalg.norm(performer.offsets_m, axis=1), np.linalg.norm(offsets(), axis=1)
    np.testing.assert_allclose(found[1:], true[1:], atol=0.008)
    np.testing.assert_allclose(performer.offsets_m[MIRROR], performer.offsets_m * [-1, 1, 1], atol=1e-9)
    assert performer.offsets_m[INDEX["left_elbow"]][0] > 0.2
    assert performer.height_m == pytest.approx(1.70, abs=0.06)


def test_noise_does_not_lengthen_bones():
    """With several cameras and with one; a plain mean of lengths would be 8 % too long for hands."""
    loud = Options(noise=2.0, spikes=False, dropouts=False, swaps=False)
    for rig, tolerance in ((2, 0.012), (1, 0.02)):
        frames, _ = record(9, RIGS[rig], loud)
        found = np.linalg.norm(calibrate(frames).performer.offsets_m, axis=1)
        np.testing.assert_allclose(found[1:], np.linalg.norm(offsets(), axis=1)[1:], atol=tolerance)


def test_one_camera_gives_floor_and_performer():
    frames, truth = record(3, RIGS[1])
    found = calibrate(frames)
    assert found.cameras["camera_0"].verdict == "good"
    assert found.cameras["camera_0"].residual_median_mm == 0
    assert found.cameras["camera_0"].depth_bias_m == 0
    tilt, height, turn = stage_error(found, truth.T_stage_camera["camera_0"])
    assert tilt < 1.5
    assert abs(height) < 0.05
    assert abs(turn) < 6
    assert found.performer.height_m == pytest.approx(1.70, abs=0.06)


def test_clocks_that_have_nothing_to_do_with_each_other(two_cameras, two_calibrated):
    frames, truth = two_cameras
    ahead_ns = 4_711_000_000_000
    late = [replace(frame, device_time_ns=frame.device_time_ns + ahead_ns) for frame in frames["camera_1"]]
    found = calibrate({**frames, "camera_1": late})
    assert not found.refused
    assert transform_error(found, truth.T_stage_camera, "camera_1").rms_m < 0.008
    before = two_calibrated.cameras["camera_1"].clock
    after = found.cameras["camera_1"].clock
    device_ns = frames["camera_1"][500].device_time_ns
    assert abs(after.stage_ns(device_ns + ahead_ns) - before.stage_ns(device_ns)) < 3_000_000


def test_another_reference_and_the_calibration_part(two_cameras, two_calibrated):
    frames, truth = two_cameras
    found = calibrate(frames, reference="camera_1", until_s=125.0)
    assert found.reference == "camera_1"
    assert found.cameras["camera_1"].clock.offset_ns == 0
    whole = two_calibrated.cameras["camera_1"].residual_pairs
    assert found.cameras["camera_0"].residual_pairs < 0.8 * whole
    assert transform_error(found, truth.T_stage_camera, "camera_0").rms_m < 0.01


def test_figures_are_those_of_the_json(two_calibrated):
    text = json.dumps(two_calibrated.to_json(), allow_nan=False)
    again = Calibration.from_json(json.loads(text))
    assert again.to_json() == two_calibrated.to_json()
    camera = again.cameras["camera_1"]
    assert camera.residual_pairs > 2000
    assert 20 < camera.residual_median_mm < camera.residual_p95_mm
    assert camera.coverage > 0.9


def test_a_missing_performer_is_measured(two_cameras, two_calibrated):
    without = replace(two_calibrated, performer=None)
    found = with_performer(without, two_cameras[0])
    assert found.cameras is without.cameras
    np.testing.assert_allclose(found.performer.bones_m()["left_knee"], 0.43, atol=0.01)
    assert with_performer(two_calibrated, two_cameras[0]) is two_calibrated


def test_joints_that_no_camera_reports_are_filled_in():
    openni = ["spine", "neck", "head", "hips"] + [
        f"{s}_{n}" for s in ("left", "right") for n in ("shoulder", "elbow", "wrist", "hip", "knee", "ankle")
    ]
    missing = [j for name, j in INDEX.items() if name not in openni]
    frames, truth = record(11, RIGS[2])
    cut = {}
    for name, mine in frames.items():
        cut[name] = []
        for frame in mine:
            positions, confidence = frame.positions.copy(), frame.confidence.copy()
            positions[missing], confidence[missing] = np.nan, 0.0
            cut[name].append(replace(frame, positions=positions, confidence=confidence))
    found = calibrate(cut)
    assert not found.refused
    assert transform_error(found, truth.T_stage_camera, "camera_1").rms_m < 0.01
    bones = found.performer.bones_m()
    assert np.isfinite(found.performer.offsets_m).all()
    assert 0.05 < bones["left_hand"] < 0.13
    assert bones["left_knee"] == pytest.approx(0.43, abs=0.01)


def test_nothing_to_calibrate_from(two_cameras):
    with refused(CalibrationError, "calibration.no_frames"):
        calibrate({"camera_0": []})
    with refused(CalibrationError, "calibration.reference_no_frames", name="elsewhere"):
        calibrate(two_cameras[0], reference="elsewhere")


def test_the_same_frames_give_the_same_calibration(two_cameras, two_calibrated):
    assert calibrate(two_cameras[0]).to_json() == two_calibrated.to_json()


def test_depth_bias_of_older_files_is_read():
    camera = {"T_stage_camera": np.eye(4).tolist(), "depth_bias_mm": 28.0}
    assert Calibration.from_json({"cameras": {"a": camera}}).cameras["a"].depth_bias_m == pytest.approx(0.028)
