"""Reading references, which have their own clocks."""

import numpy as np
import pytest

from studio.engine.animation.export import export
from studio.engine.animation.read.files import ENDINGS
from studio.engine.base.errors import FormatError
from studio.engine.metrics.evaluate import evaluate
from studio.engine.metrics.reference.alignment import clock_of
from studio.engine.metrics.reference.kinds import REFERENCE_KINDS
from studio.engine.metrics.reference.reference import Markers, Reference, read_reference
from studio.engine.model.joints import INDEX
from tests.engine.metrics.cases import dance, poses_of, reference_of
from tests.poses_factory import random_poses
from tests.refused import refused

GOOD = "time_s,hips_x,hips_y,hips_z,head_x,head_y,head_z,left_heel_x\n" + "".join(
    f"{k / 10},{k},2,3,,,,7\n" if k == 2 else f"{k / 10},{k},2,3,4,5,6,7\n" for k in range(5)
)


def test_csv_is_read(tmp_path):
    path = tmp_path / "truth.csv"
    path.write_text(GOOD)
    reference = read_reference(path)
    assert reference.time_s.tolist() == [0.0, 0.1, 0.2, 0.3, 0.4]
    assert reference.positions_m[3, INDEX["hips"]].tolist() == [3.0, 2.0, 3.0]
    assert np.isnan(reference.positions_m[2, INDEX["head"]]).all()
    assert reference.known.sum() == 2


@pytest.mark.parametrize(
    ("text", "code"),
    [
        ("", "reference.no_time_column"),
        (GOOD.replace("time_s", "time"), "reference.no_time_column"),
        (GOOD.replace("head_y", "head_q"), "reference.missing_column"),
        (GOOD[:-6], "reference.row_length"),
        (GOOD.replace("0.3,3,2", "0.3,three,2"), "table.not_a_number"),
        (GOOD.replace("0.3,", "0.1,"), "reference.time_order"),
        ("\n".join(GOOD.splitlines()[:3]) + "\n", "reference.few_samples_file"),
        ("time_s,nose_x,nose_y,nose_z\n0,1,2,3\n", "reference.no_known_joint"),
    ],
)
def test_a_broken_csv_says_what_is_wrong(tmp_path, text, code):
    path = tmp_path / "truth.csv"
    path.write_text(text)
    with refused(FormatError, code):
        read_reference(path)


def test_other_files(tmp_path):
    with refused(FormatError, "reference.none"):
        read_reference(tmp_path / "nothing.csv")
    for name, code in (("a.c3d", "c3d.not_c3d"), ("a.trc", "trc.not_trc"), ("a.npz", "poses.not_npz")):
        (tmp_path / name).write_bytes(b"x")
        with refused(FormatError, code):
            read_reference(tmp_path / name)
    (tmp_path / "truth.doc").write_text(GOOD)
    with refused(
        FormatError,
        "reference.kind",
        kinds=[".csv", ".bvh", ".fbx", ".glb", ".gltf", ".c3d", ".trc", ".npz", ".txt"],
    ):
        read_reference(tmp_path / "truth.doc")


def test_a_reference_of_another_time_is_refused():
    time = np.arange(100) / 60
    with refused(FormatError, "reference.few_instants_in_common"):
        evaluate(poses_of(time, dance(time)), reference_of(time + 50, dance(time)))


@pytest.mark.parametrize(("offset_s", "drift_ppm"), [(0.0, 0.0), (1.7, 300.0), (-2.0, -500.0)])
def test_the_clock_of_a_reference_is_found(offset_s, drift_ppm):
    """30 Hz against 100 Hz with 2.5 mm of noise."""
    rng = np.random.default_rng(3)
    time = np.arange(0, 40, 1 / 30)
    solved = dance(time) + rng.normal(0, 0.0025, (len(time), 21, 3))
    reference_time = np.arange(-5, 45, 1 / 100)  # on its own clock
    stage_time = (reference_time - offset_s) / (1 + drift_ppm * 1e-6)
    reference = reference_of(reference_time, dance(stage_time))
    poses = poses_of(time, solved)
    offset, drift = clock_of(poses, reference)
    assert offset == pytest.approx(offset_s, abs=0.002)
    assert drift == pytest.approx(drift_ppm, abs=20)
    figures = evaluate(poses, reference, same_clock=False)
    assert figures["mpjpe_mm"] < 5
    assert figures["latency_ms"] is None
    assert figures["time_offset_ms"] == pytest.approx(offset_s * 1e3, abs=2)


def test_every_key_of_the_contract_is_there():
    time = np.arange(300) / 60
    figures = evaluate(poses_of(time, dance(time)), reference_of(time, dance(time)))
    assert list(figures) == [
        "mpjpe_mm", "matched_joints", "mpjpe_root_aligned_mm", "per_joint_mm", "rms_mm",
        "acceleration_error_m_s2", "latency_ms", "absolute_difference_cm", "shortest_distance_cm",
        "spike_difference", "deviations", "nearest_sample_cm", "thesis_joints", "jerk_m_s3",
        "reference_jerk_m_s3", "spectral_arc_length", "reference_spectral_arc_length", "foot_slide_cm_s",
        "reference_foot_slide_cm_s", "foot_height_cm", "foot_height_error_cm", "contact_precision",
        "contact_recall", "own_stance_foot_slide_cm_s", "bone_length_sd_mm", "unseen_share", "uncertainty_coverage",
        "uncertainty_median_ratio", "pck_50mm", "pck_100mm", "pck_150mm", "joint_angle_error_deg",
        "flexion_error_deg", "joint_angles", "cleanup_events_per_min", "cleanup_counts", "cleanup_events",
        "alignment", "time_offset_ms", "clock_drift_ppm", "frames",
    ]  # fmt: skip


def test_c3d_and_trc_of_a_solve_are_its_joint_centres(tmp_path):
    """The exports are read back as joint centres: nothing is fitted, and nothing differs."""
    poses = random_poses(np.random.default_rng(1), seconds=3.0)
    for kind in ("c3d", "trc"):
        path = tmp_path / f"solve.{kind}"
        export(poses, path, kind)
        reference = read_reference(path)
        assert isinstance(reference, Reference)
        figures = evaluate(poses, reference)
        assert figures["mpjpe_mm"] < 0.1
        assert figures["alignment"]["rotation_deg"] < 0.05


def test_markers_of_a_laboratory_have_fitted_offsets(test_data):
    """02_01 as BVH and as the C3D of the same take: joint centres of the first against markers of the second."""
    folder = test_data / "mocap"
    markers = read_reference(folder / "02_01.c3d")
    assert isinstance(markers, Markers)
    walk = read_reference(folder / "02_01.bvh", unit_m=0.056444)
    poses = poses_of(walk.time_s[1:] - walk.time_s[1], walk.positions_m[1:])
    figures = evaluate(poses, markers)
    assert figures["mpjpe_mm"] < 30
    assert set(figures["alignment"]["marker_offsets_mm"]) == set(markers.joints)


def test_a_skeleton_of_any_format_is_a_reference(tmp_path):
    """An exported solve that is read back equals the solve."""
    poses = random_poses(np.random.default_rng(1), seconds=3.0)
    for kind in ("glb", "bvh"):
        export(poses, tmp_path / f"solve.{kind}", kind)
        unit_m = 0.01 if kind == "bvh" else None
        assert evaluate(poses, read_reference(tmp_path / f"solve.{kind}", unit_m=unit_m))["mpjpe_mm"] < 0.5
    assert set(ENDINGS) <= set(REFERENCE_KINDS)


def test_another_solve_is_a_reference(tmp_path):
    poses = random_poses(np.random.default_rng(1), seconds=3.0)
    poses.save(tmp_path / "poses.npz")
    assert evaluate(poses, read_reference(tmp_path / "poses.npz"))["mpjpe_mm"] < 1e-6


def test_nothing_is_known_in_a_gap():
    """Example: a solve that lost its performer for two seconds. A spline would diverge there."""
    times = np.concatenate([np.arange(0.0, 2.0, 0.02), np.arange(4.0, 6.0, 0.02)])
    places = np.sin(3.0 * times)[:, None, None] * np.ones((1, 21, 3))
    reference = Reference(times, places)
    at = np.array([1.0, 1.985, 2.5, 3.0, 3.9, 4.01, 5.0])
    assert np.isnan(reference.at(at)[:, 0, 0]).tolist() == [False, True, True, True, True, False, False]
    sparse = Reference(times[::50], places[::50])
    assert np.isfinite(sparse.at(np.array([0.5, 4.5]))).all()
