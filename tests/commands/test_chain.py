"""The chain of commands on a simulated recording, as the README shows it, and `bench`."""

import json
from pathlib import Path

import pytest

from studio.engine.model.joints import MEASURED_JOINTS
from studio.engine.model.poses import Poses
from studio.lab.bench import run, stages, timing
from tests.commands.program import one_line, studio, studio_process

FIGURES = {
    "mpjpe_mm", "matched_joints", "mpjpe_root_aligned_mm", "per_joint_mm", "rms_mm", "acceleration_error_m_s2",
    "latency_ms", "absolute_difference_cm", "shortest_distance_cm", "spike_difference", "deviations",
    "nearest_sample_cm", "thesis_joints", "jerk_m_s3", "reference_jerk_m_s3", "spectral_arc_length",
    "reference_spectral_arc_length", "foot_slide_cm_s", "reference_foot_slide_cm_s", "foot_height_cm",
    "foot_height_error_cm", "contact_precision", "contact_recall", "own_stance_foot_slide_cm_s", "bone_length_sd_mm",
    "unseen_share",
    "uncertainty_coverage", "uncertainty_median_ratio", "pck_50mm", "pck_100mm", "pck_150mm", "joint_angle_error_deg",
    "flexion_error_deg", "joint_angles", "cleanup_events_per_min", "cleanup_counts", "cleanup_events", "alignment",
    "time_offset_ms", "clock_drift_ppm", "frames",
}  # fmt: skip

WARM_UP = 1
"""Frames of a stage that `bench` does not count: few."""


@pytest.fixture(scope="module")
def stage(test_data, tmp_path_factory) -> Path:
    """A folder with the take `walk`: simulated, calibrated and solved by two presets."""
    folder = tmp_path_factory.mktemp("chain")
    for program, *command in (
        (studio_process, "simulate", test_data / "mocap" / "02_01.bvh", "--out", "walk", "--cameras", "2",
         "--seed", "1", "--unit-m", "0.056444"),
        (studio, "calibrate", "walk", "--json", "calibration.json"),
        (studio, "solve", "walk", "--json", "solve.json"),
        (studio, "solve", "walk", "--preset", "raw", "--set", "output_hz=30", "hands=off", "--name", "raw 30"),
    ):  # fmt: skip
        done = program(*command, cwd=folder)
        assert (done.returncode, done.stderr) == (0, ""), done.stderr
    return folder


def test_calibration_json(stage):
    result = json.loads((stage / "calibration.json").read_text())
    assert list(result["cameras"]) == ["camera_0", "camera_1"]
    keys = {"T_stage_camera", "residual_median_mm", "residual_p95_mm", "residual_pairs", "time_offset_ms",
            "clock_drift_ppm", "coverage", "verdict", "reasons"}  # fmt: skip
    assert keys <= set(result["cameras"]["camera_1"])
    assert 1.3 < result["performer"]["height_m"] < 1.9
    assert json.loads((stage / "walk" / "take.json").read_text())["calibration"] == 1


def test_solves_skip_the_calibration_part(stage):
    calibration_s = json.loads((stage / "walk" / "take.json").read_text())["calibration_s"]
    poses = Poses.load(stage / "walk" / "solves" / "studio" / "poses.npz")
    assert poses.time_s[0] >= calibration_s
    slower = Poses.load(stage / "walk" / "solves" / "raw 30" / "poses.npz")
    assert slower.frames_per_second == pytest.approx(30, abs=0.01)
    assert json.loads((stage / "solve.json").read_text())["frames"] == poses.frame_count


def test_evaluate_has_every_figure(stage):
    done = studio("evaluate", "walk", "--reference", "walk.truth.csv", "--json", "figures.json",
                  "--report", "report.html", cwd=stage)  # fmt: skip
    assert (done.returncode, done.stderr) == (0, "")
    assert "<svg" in (stage / "report.html").read_text()
    solves = json.loads((stage / "figures.json").read_text())["solves"]
    assert set(solves) == {"studio", "raw 30"}
    for figures in solves.values():
        assert set(figures) == FIGURES
        assert figures["matched_joints"] == list(MEASURED_JOINTS)
        assert figures["mpjpe_root_aligned_mm"] < 60
        missing = {key for key, value in figures.items() if value is None}
        assert missing <= {"contact_precision"}  # raw joints shake too much to stand anywhere
    assert solves["studio"]["bone_length_sd_mm"] < 1 < solves["raw 30"]["bone_length_sd_mm"]
    assert "MPJPE mm" in done.stdout
    one = studio(
        "evaluate",
        "walk",
        "--reference",
        "walk.truth.csv",
        "--solve",
        "raw 30",
        "--edit-list",
        "--json",
        "one.json",
        cwd=stage,
    )
    assert one.returncode == 0
    assert "aligned away for raw 30: turned by" in one.stdout
    assert "clean-up of raw 30 (time since the performance began, at stage time" in one.stdout
    assert "joint pop" in one.stdout
    assert list(json.loads((stage / "one.json").read_text())["solves"]) == ["raw 30"]


def test_evaluate_with_a_broken_reference(stage):
    (stage / "bad.csv").write_text("time_s,hips_x,hips_y\n0,1,2\n")
    line = one_line(studio("evaluate", "walk", "--reference", "bad.csv", "--json", "b.json", cwd=stage), 1)
    assert "hips_z is missing" in line
    assert not (stage / "b.json").exists()
    cut = (stage / "walk.truth.csv").read_text()[:-50]
    (stage / "cut.csv").write_text(cut)
    line = one_line(studio("evaluate", "walk", "--reference", "cut.csv", cwd=stage), 1)
    assert f"cut.csv, line {len(cut.splitlines())}" in line


@pytest.mark.parametrize("kind", ["fbx", "bvh", "glb", "csv"])
def test_export(stage, kind):
    done = studio("export", "walk", "--format", kind, "--out", f"walk.{kind}", cwd=stage)
    assert (done.returncode, done.stderr) == (0, "")
    assert "solve studio" in done.stdout
    assert (stage / f"walk.{kind}").stat().st_size > 10_000


def test_export_with_options(stage):
    options = ("--target", "unreal", "--root-motion", "root", "--mesh", "--key-error-cm", "0.1", "--foot-lock",
               "--start", "1", "--end", "3", "--timecode", "10:00:00:00", "--also", "walk")  # fmt: skip
    done = studio("export", "walk", "--format", "fbx", "--out", "game.fbx", *options, cwd=stage)
    assert (done.returncode, done.stderr) == (0, "")
    data = (stage / "game.fbx").read_bytes()
    assert all(
        name in data
        for name in (b"ik_hand_gun", b"Mannequin", b"walk\x00\x01AnimStack", b"walk 2\x00\x01AnimStack")
    )


def test_export_that_is_refused(stage):
    line = one_line(
        studio("export", "walk", "--format", "bvh", "--out", "x.bvh", "--timecode", "take", cwd=stage), 2
    )
    assert "walk has none" in line
    line = one_line(
        studio("export", "walk", "--format", "csv", "--out", "x.csv", "--target", "vrm", cwd=stage), 2
    )
    assert "not for csv" in line
    line = one_line(
        studio("export", "walk", "--format", "fbx", "--out", "x.fbx", "--solve", "best", cwd=stage), 1
    )
    assert "raw 30, studio" in line
    assert not list(stage.glob("x.*"))


def test_picture(stage):
    done = studio("picture", "walk", "--out", "walk.png", "--count", "3", cwd=stage)
    assert done.returncode == 0, done.stderr
    assert (stage / "walk.png").read_bytes().startswith(b"\x89PNG")


def test_doctor_finds_nothing_wrong(stage):
    done = studio("doctor", "walk", "--json", "doctor.json", cwd=stage)
    assert (done.returncode, done.stderr) == (0, "")
    assert json.loads((stage / "doctor.json").read_text())["takes"] == []


def test_a_refused_calibration_is_kept_but_not_used(stage, test_data, tmp_path):
    recording = tmp_path / "short"  # 6 s are no walk
    for camera in ("camera_0", "camera_1"):
        (recording / camera).mkdir(parents=True)
        with open(test_data / "noisy_joints" / "jumps_2_cameras" / camera / "joints.csv") as file:
            (recording / camera / "joints.csv").write_text("".join(next(file) for _ in range(180)))
    assert studio("import", "short", "--out", "take", cwd=tmp_path).returncode == 0
    line = one_line(studio("calibrate", "take", "--json", "c.json", cwd=tmp_path), 1)
    assert "refused" in line
    cameras = json.loads((tmp_path / "c.json").read_text())["cameras"]
    assert [camera["verdict"] for camera in cameras.values()] == ["good", "refused"]
    assert cameras["camera_1"]["reasons"]
    assert (tmp_path / "take" / "calibrations" / "1.json").is_file()
    assert json.loads((tmp_path / "take" / "take.json").read_text())["calibration"] is None


def test_bench_measures_every_stage(tmp_path, monkeypatch):
    monkeypatch.setattr(run, "TURNS", 1)
    for module in (timing, stages):
        monkeypatch.setattr(module, "WARM_UP", WARM_UP)
    monkeypatch.setattr(run, "MOST_IMAGES", WARM_UP + 1)
    done = studio("bench", "--frames", "30", "--json", "bench.json", "--report", "bench.html", cwd=tmp_path)
    assert (done.returncode, done.stderr) == (0, "")
    assert "<svg" in (tmp_path / "bench.html").read_text()
    figures_of = json.loads((tmp_path / "bench.json").read_text())["stages"]
    wanted = {"parse", "record", "sync", "fusion", "solve", "solve_mink", "mink_frame_tasks", "mink_retargeting",
              "completion", "filter_holt", "filter_one_euro", "pipeline", "encode", "broadcast", "finish",
              "pipeline_1_of_4", "pipeline_2_of_4",
              "tracker_1", "tracker_3", "export_fbx", "export_bvh"}  # fmt: skip
    assert wanted <= set(figures_of)
    for name, figures in figures_of.items():
        assert 0 < figures["median_ms"] <= figures["p99_ms"]
        assert figures["frames_per_second"] > 0
        assert (figures["ratio_to_mink_frame_tasks"] is None) == (
            name not in ("solve", "solve_mink", "mink_frame_tasks", "mink_retargeting")
        )
