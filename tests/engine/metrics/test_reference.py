"""Reading references, and clocks of their own."""

import numpy as np
import pytest

from studio.engine.errors import FormatError, NotAvailableError
from studio.engine.joints import INDEX
from studio.engine.metrics.alignment import clock_of
from studio.engine.metrics.evaluate import evaluate
from studio.engine.metrics.reference import read_reference
from tests.engine.metrics.cases import dance, poses_of, reference_of

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
    ("text", "says"),
    [
        ("", "time_s"),
        (GOOD.replace("time_s", "time"), "time_s"),
        (GOOD.replace("head_y", "head_q"), "head_y is missing"),
        (GOOD[:-6], "line 6"),
        (GOOD.replace("0.3,3,2", "0.3,three,2"), "line 5"),
        (GOOD.replace("0.3,", "0.1,"), "line 5"),
        ("\n".join(GOOD.splitlines()[:3]) + "\n", "at least 4"),
        ("time_s,nose_x,nose_y,nose_z\n0,1,2,3\n", "no joint is known"),
    ],
)
def test_a_broken_csv_says_what_is_wrong(tmp_path, text, says):
    path = tmp_path / "truth.csv"
    path.write_text(text)
    with pytest.raises(FormatError, match=says):
        read_reference(path)


def test_other_files(tmp_path):
    with pytest.raises(FormatError, match="no reference at"):
        read_reference(tmp_path / "nothing.csv")
    for name, error in (("markers.c3d", NotAvailableError), ("markers.trc", NotAvailableError)):
        (tmp_path / name).write_bytes(b"x")
        with pytest.raises(error):
            read_reference(tmp_path / name)
    (tmp_path / "truth.txt").write_text(GOOD)
    with pytest.raises(FormatError, match=r"\.txt"):
        read_reference(tmp_path / "truth.txt")


def test_a_reference_of_another_time_is_refused():
    time = np.arange(100) / 60
    with pytest.raises(FormatError, match="share fewer than 4 instants"):
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
        "contact_recall", "bone_length_sd_mm", "unseen_share", "uncertainty_coverage",
        "uncertainty_median_ratio", "pck_50mm", "pck_100mm", "pck_150mm", "joint_angle_error_deg",
        "flexion_error_deg", "joint_angles", "cleanup_events_per_min", "cleanup_counts", "cleanup_events",
        "alignment", "time_offset_ms", "clock_drift_ppm", "frames",
    ]  # fmt: skip
