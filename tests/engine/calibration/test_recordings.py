"""Calibration of outside recordings: simulated cameras with known truth, and pairs of real Kinects without truth."""

import csv
import json
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from studio.engine.base.geometry import fit_rigid, transform_points
from studio.engine.calibration.calibrate import calibrate
from studio.engine.calibration.cameras.pairs import LocalClock, grid, make_track, sample
from studio.engine.calibration.cameras.refine import PlacedCamera
from studio.engine.calibration.cameras.swaps import find_swaps
from studio.engine.calibration.holding import MustHold
from studio.engine.calibration.quality.agreement import disagreements
from studio.engine.calibration.quality.residuals import even_blocks, residuals
from studio.engine.model.calibration import Calibration
from studio.engine.model.frames import CameraFrame, FrameSet
from studio.engine.model.joints import CANONICAL, JOINT_COUNT, JOINT_SETS, MIRROR, to_canonical
from tests.engine.calibration.scoring import clock_error_ms, spans_of, stage_error, transform_error
from tests.engine.calibration.test_watch import alarms, apart

SETS = {
    "punches_2_cameras": (0.015, 0.5),
    "jumps_2_cameras": (0.015, 0.5),
    "jumping_jacks_3_cameras": (0.015, 0.5),
    "ballet_4_cameras": (0.02, 0.8),
}
PAIRS = {
    "Study_16_Kinect_0_Time_6_13_59_PM.csv": 17.0,
    "Study_16_Kinect_1_Time_6_18_45_PM.csv": 32.0,
    "Study_13_Kinect_2_Time_5_22_05_PM.csv": 52.0,
}
STUDY_2 = "Study_2_Kinect_0_Time_12_18_53_PM.csv"


def joint_frames(folder: Path) -> list[CameraFrame]:
    """The frames of a `joints.csv`."""
    with (folder / "joints.csv").open() as file:
        header = file.readline().strip().split(",")
    table = np.genfromtxt(folder / "joints.csv", delimiter=",", skip_header=1)
    columns = [
        [header.index(f"{name}_{field}") for field in ("x", "y", "z", "confidence")] for name in CANONICAL
    ]
    values = table[:, np.array(columns)]
    confidence = np.nan_to_num(values[:, :, 3])
    return [
        CameraFrame(folder.name, i, round(table[i, 0] * 1e9), values[i, :, :3], confidence[i])
        for i in range(len(table))
    ]


@pytest.fixture
def noisy_joints(test_data: Path) -> Path:
    if not (test_data / "noisy_joints").is_dir():
        pytest.skip(f"no noisy_joints in {test_data}")
    return test_data / "noisy_joints"


@pytest.mark.parametrize("name", SETS)
def test_simulated_cameras_come_out_where_they_are(noisy_joints, name):
    """They also never disagree."""
    folder = noisy_joints / name
    frames = {camera.name: joint_frames(camera) for camera in sorted(folder.glob("camera_*"))}
    until_s = json.loads((folder / "recording.json").read_text())["calibration_s"]
    found = calibrate(frames, until_s=until_s)
    cameras = json.loads((folder / "truth" / "cameras.json").read_text())["cameras"]
    truth = {camera: np.array(values["T_stage_camera"]) for camera, values in cameras.items()}
    assert not found.refused, found.reasons()
    for camera in list(frames)[1:]:
        error = transform_error(found, truth, camera)
        assert error.rms_m <= SETS[name][0]
        assert error.angle_deg <= SETS[name][1]
        clock = cameras[camera]
        for stage_s in (1.0, 33.0):
            ms = clock_error_ms(found, camera, stage_s, clock["clock_offset_s"], clock["clock_drift"])
            assert ms <= 8.0
    tilt, height, turn = stage_error(found, truth["camera_0"])
    assert tilt < 1.0
    assert abs(height) < 0.04
    assert abs(turn) < 3.0
    assert not any(disagreements(found, frames).values())


@pytest.mark.parametrize("name", SETS)
def test_one_simulated_camera_gives_a_stage(noisy_joints, name):
    camera = noisy_joints / name / "camera_0"
    found = calibrate({"camera_0": joint_frames(camera)}, until_s=34.3)
    truth = json.loads((camera.parent / "truth" / "cameras.json").read_text())["cameras"]["camera_0"]
    assert found.cameras["camera_0"].verdict == "good"
    tilt, height, turn = stage_error(found, np.array(truth["T_stage_camera"]))
    assert tilt < 1.5
    assert abs(height) < 0.06
    assert abs(turn) < 5.0


def kinect_frames(path: Path) -> dict[str, list[CameraFrame]]:
    """The first person of a CSV of two Kinects, in camera axes; each Kinect with its own clock."""
    names = JOINT_SETS["kinect-v2"]
    frames: dict[str, dict[int, CameraFrame]] = {}
    with path.open() as file:
        for row in csv.DictReader(file, skipinitialspace=True):
            if row["Person_Id"] != "0":
                continue
            points = np.array([[float(row[f"{name}_{axis}"]) for axis in "XYZ"] for name in names])
            points[(points == -9999).any(axis=1)] = np.nan
            points = points * [-1, -1, 1]
            seen = np.isfinite(points).all(axis=1).astype(float)
            time_ns = int(row["Skeleton_Time"]) * 100
            mine = frames.setdefault(row["Kinect_Id"], {})
            mine[time_ns] = CameraFrame(
                row["Kinect_Id"], len(mine), time_ns, *to_canonical("kinect-v2", points, seen)
            )
    return {name: [mine[t] for t in sorted(mine)] for name, mine in frames.items()}


@cache
def read(path: Path) -> dict[str, list[CameraFrame]]:
    """A pair's frames, or a skip."""
    if not path.is_file():
        pytest.skip(f"no {path}")
    return kinect_frames(path)


@cache
def calibrated(
    path: Path, must_hold: MustHold = "always"
) -> tuple[dict[str, list[CameraFrame]], Calibration]:
    """A pair's frames and its calibration."""
    return read(path), calibrate(read(path), must_hold=must_hold)


@pytest.mark.parametrize("name", PAIRS)
def test_real_kinects_agree(test_data, name):
    frames, found = calibrated(test_data / "kinect2_pairs" / name)
    second = list(found.cameras.values())[1]
    assert second.verdict in ("good", "usable"), second.reasons
    assert second.residual_median_mm <= PAIRS[name]
    assert second.residual_pairs > 10_000
    assert 1.4 < found.performer.height_m < 2.0
    assert not any(disagreements(found, frames).values())


@pytest.mark.parametrize("name", PAIRS)
def test_injected_swaps_are_found(test_data, name):
    """Left and right are exchanged in a tenth of one real stream, in bursts; its own swaps are found beforehand."""
    frames, calibration = calibrated(test_data / "kinect2_pairs" / name)
    tracks = [make_track(mine) for mine in frames.values()]
    cameras = list(calibration.cameras.values())
    times_s = grid(tracks[0])
    epoch_ns = cameras[0].clock.stage_ns(tracks[0].epoch_ns)
    offset_s = (cameras[1].clock.stage_ns(tracks[1].epoch_ns) - epoch_ns) * 1e-9
    joints = [
        transform_points(camera.T_stage_camera, sample(track, times_s - shift_s)[0])
        for camera, track, shift_s in zip(cameras, tracks, (0.0, offset_s), strict=True)
    ]
    own = find_swaps(np.array(joints))[1]
    rng, injected = np.random.default_rng(1), np.zeros(len(times_s), dtype=bool)
    while injected.mean() < 0.1:
        begin = rng.integers(len(times_s))
        injected[begin : begin + rng.integers(3, 45)] = True
    joints[1] = np.where(injected[:, None, None], joints[1][:, MIRROR], joints[1])
    seen = np.isfinite(joints).all(axis=(0, 3)).sum(axis=1) >= 10
    changed = find_swaps(np.array(joints))[1] != own
    assert changed[injected & seen].mean() >= 0.95
    assert changed[~injected & seen].mean() <= 0.01


def test_real_kinects_that_disagree_at_the_end(test_data: Path):
    _, whole = calibrated(test_data / "kinect2_pairs" / STUDY_2)
    assert whole.refused
    frames, found = calibrated(test_data / "kinect2_pairs" / STUDY_2, "somewhere")
    second = list(found.cameras)[1]
    camera = found.cameras[second]
    assert camera.verdict == "usable", camera.reasons
    (span,) = spans_of(found, frames, second)
    assert 99.0 < span.from_s < 100.5
    assert span.to_s is None
    assert camera.residual_median_mm < 15.0
    assert camera.residual_pairs > 20_000


def test_real_kinects_that_disagree_for_their_last_second_are_told_at_that_moment(test_data: Path):
    frames, found = calibrated(test_data / "kinect2_pairs" / STUDY_2, "somewhere")
    tracks = {name: make_track(mine) for name, mine in frames.items()}
    starts = {
        name: found.cameras[name].clock.stage_ns(track.epoch_ns) * 1e-9 for name, track in tracks.items()
    }
    first_s = starts[found.reference]
    times = np.arange(0.0, tracks[found.reference].times_s[-1], 1 / 30)
    seen = np.array(
        [
            transform_points(
                found.cameras[name].T_stage_camera, sample(track, times + first_s - starts[name])[0]
            )
            for name, track in tracks.items()
        ]
    )
    weights, places = np.ones((*seen.shape[:1], JOINT_COUNT)), np.zeros((2, 3))
    shown = [
        FrameSet(round(t * 1e9), tuple(tracks), seen[:, i], weights, places) for i, t in enumerate(times)
    ]
    told = apart(shown)
    assert {name for _, name in told} == set(frames)
    assert all(100.0 < at_s < 101.3 for at_s, _ in told)
    assert not alarms(shown)  # a second is too short to report a moved camera


def kabsch(source, target, share: float):
    """A trimmed rigid fit: the share of points with the least residuals decides."""
    T = fit_rigid(source, target, np.ones(len(source)))
    for _ in range(20):
        off = np.linalg.norm(transform_points(T, source) - target, axis=1)
        T = fit_rigid(source, target, (off <= np.quantile(off, share)).astype(float))
    return T


@pytest.mark.parametrize("name", [*PAIRS, STUDY_2])
def test_no_trimmed_kabsch_does_better_on_the_same_blocks(test_data: Path, name: str):
    """An independent baseline: fitted on even blocks, with a search for its lag, and scored on odd blocks as well."""
    frames, calibration = calibrated(test_data / "kinect2_pairs" / name)
    found = list(calibration.cameras.values())
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
