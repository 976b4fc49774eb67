"""Importing the real recordings in the folder of outside data."""

import csv
import json
import shutil
from pathlib import Path

import numpy as np
import pytest

from studio.engine.base.geometry import fit_rigid, rotation_xyz, transform_points
from studio.engine.identity.whole_take import find_people
from studio.engine.model.joints import INDEX
from studio.take.importers import import_recording
from studio.take.raw.depth import depth_frames
from studio.take.raw.frames import camera_frames, inspect_raw

PAIRS = {
    "Study_13_Kinect_2_Time_5_22_05_PM": (1540, 1470),
    "Study_16_Kinect_0_Time_6_13_59_PM": (2044, 1991),
    "Study_16_Kinect_1_Time_6_18_45_PM": (1507, 1536),
    "Study_18_Kinect_2_Time_10_55_24_PM": (125, 131),
    "Study_20_Kinect_1_Time_1_30_34_PM": (643, 679),
}
SHORT = ("Study_13_Kinect_2_Time_5_22_05_PM", "Study_18_Kinect_2_Time_10_55_24_PM")
"""One of usual length and one of seconds; the others are long."""


def left_is_left(positions: np.ndarray) -> float:
    """Share of frames in which the left hip is to the left of where the feet point; camera frames, y down."""
    forward = sum(
        positions[:, INDEX[f"{s}_toe"]] - positions[:, INDEX[f"{s}_ankle"]] for s in ("left", "right")
    )
    left = positions[:, INDEX["left_hip"]] - positions[:, INDEX["right_hip"]]
    return float((np.einsum("fi,fi->f", np.cross([0.0, -1.0, 0.0], forward), left) > 0).mean())


@pytest.mark.parametrize(
    "name", [name if name in SHORT else pytest.param(name, marks=pytest.mark.long) for name in PAIRS]
)
def test_kinect_pairs(test_data: Path, tmp_path: Path, name: str) -> None:
    take = import_recording(test_data / "kinect2_pairs" / f"{name}.csv", tmp_path / "take")
    summary = inspect_raw(take.raw_path)
    assert summary.complete and summary.frames == dict(
        zip(("camera_0", "camera_1"), PAIRS[name], strict=True)
    )
    frames = camera_frames(take.raw_path)
    times = {camera: np.array([f.device_time_ns for f in of]) for camera, of in frames.items()}
    positions = {camera: np.array([f.positions for f in of]) for camera, of in frames.items()}
    for camera in frames:
        assert (np.diff(times[camera]) >= 30e6).all()
        assert 30 < take.meta["cameras"][0]["frames_per_second"] < 30.5
        assert left_is_left(positions[camera]) > 0.97
        head, ankle = positions[camera][:, INDEX["head"], 1], positions[camera][:, INDEX["left_ankle"], 1]
        assert (head < ankle).all()
    assert abs(int(times["camera_0"][0]) - int(times["camera_1"][0])) < 100e6
    same = np.abs(times["camera_1"][:, None] - times["camera_0"][None]).argmin(axis=0)
    near = np.abs(times["camera_1"][same] - times["camera_0"]) < 20e6
    a, b = positions["camera_0"][near].reshape(-1, 3), positions["camera_1"][same[near]].reshape(-1, 3)
    weights = np.ones(len(a))
    for _ in range(5):
        T = fit_rigid(a, b, weights)
        distance = np.linalg.norm(transform_points(T, a) - b, axis=1)
        weights = 1 / (1 + (distance / 0.05) ** 2)
    assert np.median(distance) < 0.07  # the same person in both cameras


def test_two_persons_are_in_one_frame_in_both_kinects(test_data: Path, tmp_path: Path) -> None:
    """The recorder turned each stream about the vertical; by its own columns person 0's by 7.22 degrees more."""
    name = "Study_20_Kinect_1_Time_1_30_34_PM"
    take = import_recording(test_data / "kinect2_pairs" / f"{name}.csv", tmp_path / "take")
    assert "turned by 7." in take.meta["notes"]
    calibration = take.calibration()
    for camera in calibration.cameras.values():
        assert camera.verdict == "usable"
        assert (camera.residual_median_mm or 0.0) < 40.0
        assert 0.9 < camera.T_stage_camera[2, 3] < 1.15  # the file says 1 m
    people = find_people(camera_frames(take.raw_path), calibration, everybody=True)
    short, tall = (one.calibration.performer for one in people.performers)
    assert short is not None and tall is not None and people.bystanders == 0
    assert 1.5 < short.height_m < 1.7 < tall.height_m < 1.9
    assert [len(one.undecided_s) <= 3 for one in people.performers] == [True, True]


def test_who_cannot_be_brought_beside_the_others_is_left_out_and_told(
    test_data: Path, tmp_path: Path
) -> None:
    """The second Kinect's stream of person 1 is tilted by 20 degrees, which no recorder of this kind does."""
    name = "Study_20_Kinect_1_Time_1_30_34_PM"
    with open(test_data / "kinect2_pairs" / f"{name}.csv", newline="") as file:
        header, *rows = csv.reader(file, skipinitialspace=True)
    kinect, person, first = header.index("Kinect_Id"), header.index("Person_Id"), header.index("AnkleLeft_X")
    for row in rows:
        if row[kinect].endswith("136") and row[person] == "1":
            points = np.array(row[first:], dtype=float).reshape(-1, 3)
            row[first:] = (points @ rotation_xyz(np.radians(20.0), 0.0, 0.0).T).ravel().round(5).astype(str)
    with open(tmp_path / "tilted.csv", "w", newline="") as file:
        csv.writer(file).writerows([header, *rows])
    take = import_recording(tmp_path / "tilted.csv", tmp_path / "take")
    assert "camera_1: person 0 was left out: beside person 1" in take.meta["notes"]
    bodies = {one.body for frame in camera_frames(take.raw_path)["camera_1"] for one in frame.bodies()}
    assert bodies == {1}
    assert take.meta["calibration"] is None and "no calibration by these persons" in take.meta["notes"]


def test_a_person_who_faces_the_camera_has_the_left_hand_at_positive_x(
    test_data: Path, tmp_path: Path
) -> None:
    take = import_recording(test_data / "kinect2_tracking_state" / "Ges01_wavehand.csv", tmp_path / "take")
    ((first, *_),) = camera_frames(take.raw_path).values()
    assert first.positions[INDEX["left_shoulder"], 0] > first.positions[INDEX["right_shoulder"], 0] + 0.2
    assert first.positions[INDEX["head"], 1] < first.positions[INDEX["hips"], 1] - 0.5
    assert 2 < first.positions[INDEX["hips"], 2] < 3.5


@pytest.mark.parametrize(
    ("name", "count"),
    [("Ges01_wavehand", 154), ("Ges02_balancinghands", 161), ("Ges06_chickenwing", 160), ("joints", 371)],
)
def test_kinect_tracking_states(test_data: Path, tmp_path: Path, name: str, count: int) -> None:
    take = import_recording(test_data / "kinect2_tracking_state" / f"{name}.csv", tmp_path / "take")
    frames = camera_frames(take.raw_path)["camera_0"]
    assert len(frames) == count
    confidence = np.array([f.confidence for f in frames])
    assert set(np.unique(confidence.round(6))) <= {0.0, 0.4, 1.0} and (confidence > 0).all()
    assert left_is_left(np.array([f.positions for f in frames])) > 0.9


@pytest.mark.parametrize(
    ("name", "cameras", "count"),
    [
        ("punches_2_cameras", 2, 1419),
        pytest.param("jumps_2_cameras", 2, 1449, marks=pytest.mark.long),
        pytest.param("jumping_jacks_3_cameras", 3, 1449, marks=pytest.mark.long),
        ("ballet_4_cameras", 4, 1250),
    ],
)
def test_noisy_joints(test_data: Path, tmp_path: Path, name: str, cameras: int, count: int) -> None:
    take = import_recording(test_data / "noisy_joints" / name, tmp_path / "take")
    assert (
        take.meta["calibration_s"] == 34.3 and take.meta["calibration"] is None and take.meta["notes"] == ""
    )
    frames = camera_frames(take.raw_path)
    assert {camera: len(of) for camera, of in frames.items()} == {
        f"camera_{k}": count for k in range(cameras)
    }
    unseen = np.isnan([f.positions[:, 0] for f in frames["camera_0"]]).mean()
    assert 0.01 < unseen < 0.1
    lines = (test_data / "noisy_joints" / name / "camera_0" / "joints.csv").read_text().splitlines()
    assert frames["camera_0"][-1].device_time_ns == round(float(lines[-1].split(",")[0]) * 1e9)


def test_a_genuine_azure_kinect_file(test_data: Path, tmp_path: Path) -> None:
    take = import_recording(test_data / "sensor_files" / "pyk4a_recording.mkv", tmp_path / "take")
    (camera,) = take.meta["cameras"]
    assert (camera["device"], camera["serial"]) == ("Azure Kinect", "001514394512")
    assert take.meta["created"] == "2020-08-31T15:20:37+00:00" and take.meta["notes"] == ""
    (frame,) = depth_frames(take.raw_path)
    assert frame.depth_mm.shape == (576, 640) and frame.device_time_ns == 336_277_000 + 463_945_000
    seen = frame.depth_mm[frame.depth_mm > 0]
    assert 0.7 < len(seen) / frame.depth_mm.size < 0.8 and 1400 < np.median(seen) < 1600
    factory = json.loads((test_data / "sensor_files" / "pyk4a_calibration.json").read_text())
    parameters = factory["CalibrationInformation"]["Cameras"][0]["Intrinsics"]["ModelParameters"]
    intrinsics = camera["intrinsics"]
    assert intrinsics["fx"] == pytest.approx(1024 * parameters[2])
    assert intrinsics["cx"] == pytest.approx(1024 * parameters[0] - 192 - 0.5)
    assert intrinsics["distortion"][2:4] == [parameters[13], parameters[12]]


def test_a_genuine_realsense_file(test_data: Path, tmp_path: Path) -> None:
    take = import_recording(test_data / "sensor_files" / "single_depth_color_640x480.bag", tmp_path / "take")
    (camera,) = take.meta["cameras"]
    assert camera["device"] == "Intel RealSense D435" and camera["intrinsics"]["fx"] == pytest.approx(
        390.4315, abs=1e-3
    )
    frames = list(depth_frames(take.raw_path))
    assert [f.device_time_ns for f in frames] == [360_815_089_000, 360_981_765_000]
    assert 1400 < np.median(frames[0].depth_mm[frames[0].depth_mm > 0]) < 1500


def test_depth_of_three_cameras(test_data: Path, tmp_path: Path) -> None:
    folder = tmp_path / "few"
    shutil.copytree(
        test_data / "depth" / "punch_3_azure_kinect", folder, ignore=shutil.ignore_patterns("truth")
    )
    for camera in folder.glob("camera_*"):
        camera.chmod(0o755)
        (camera / "depth.txt").chmod(0o644)
        lines = (camera / "depth.txt").read_text().splitlines()
        (camera / "depth.txt").write_text("\n".join(lines[:12]))
    take = import_recording(folder, tmp_path / "take")
    assert take.meta["calibration"] == 1 and take.meta["calibration_s"] == 2.5
    assert sum(inspect_raw(take.raw_path).depth_frames.values()) >= 34
    times = [f.device_time_ns for f in depth_frames(take.raw_path)]
    assert times == sorted(times)
