"""Other motions aligned with a solve's stage, differences over time, and figures of a solve alone."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from studio.engine.animation.clip.resample import frames_of
from studio.engine.base.errors import FormatError
from studio.engine.base.geometry import make_transform, transform_points
from studio.engine.metrics.compare import compare, differences
from studio.engine.metrics.evaluate import evaluate
from studio.engine.metrics.own import own_figures
from studio.engine.metrics.reference.canonical import canonical_positions
from studio.engine.metrics.reference.placing import PlacedMotion, line_up, on_stage, place
from studio.engine.metrics.reference.reference import Reference
from studio.engine.model.joints import OUTPUT_INDEX
from tests.poses_factory import random_poses, t_pose
from tests.refused import refused

TURN = Rotation.from_euler("z", 40, degrees=True).as_matrix()


@pytest.fixture(scope="module")
def poses():
    return random_poses(np.random.default_rng(3), seconds=12.0)


def elsewhere(poses, *, ahead_s=0.7, size=1.0):
    """The same motion in another place, with a clock that is ahead."""
    points = transform_points(
        make_transform(TURN, np.array([2.0, -1.0, 0.4])), size * canonical_positions(poses)
    )
    return Reference(poses.time_s + ahead_s, points)


def test_a_reference_is_brought_to_the_stage(poses, tmp_path):
    placed = place(poses, elsewhere(poses, size=1.1), same_clock=False, similarity=True)
    assert placed.aligned["time_offset_ms"] == pytest.approx(700, abs=1)
    assert placed.aligned["scale"] == pytest.approx(1.1, abs=1e-3)
    assert placed.aligned["rotation_deg"] == pytest.approx(40, abs=0.1)
    assert differences(poses, placed.motion).summary().mean_mm < 1.0  # the clock is found before the size
    placed.save(tmp_path / "placed.npz")
    kept = PlacedMotion.load(tmp_path / "placed.npz")
    assert kept.aligned == placed.aligned
    np.testing.assert_allclose(kept.motion.positions_m, placed.motion.positions_m, atol=1e-6)
    (tmp_path / "placed.npz").write_bytes(b"nothing")
    with refused(FormatError, "reference.placed_damaged"):
        PlacedMotion.load(tmp_path / "placed.npz")


def test_a_take_of_the_same_movement_is_lined_up(poses):
    moved = elsewhere(poses)
    T = make_transform(TURN, np.array([2.0, -1.0, 0.4]))
    other = replace(poses, time_s=poses.time_s + 0.7, positions_m=transform_points(T, poses.positions_m))
    alignment = line_up(poses, other)
    assert alignment.offset_s == pytest.approx(0.7, abs=1e-3)
    np.testing.assert_allclose(alignment.T_reference_stage, T, atol=1e-3)
    assert differences(poses, on_stage(moved, alignment)).summary().max_mm < 5.0


def test_differences_over_time(poses):
    positions = poses.positions_m.copy()
    positions[100:110, OUTPUT_INDEX["LeftHand"]] += [0.0, 0.0, 0.2]
    found = compare(poses, replace(poses, positions_m=positions))
    assert found.max_mm == pytest.approx(200, abs=1e-6)
    assert found.per_joint_mm["left_wrist"] == pytest.approx(200 * 10 / poses.frame_count, rel=1e-6)
    assert found.worst[0].joint == "left_wrist"
    assert 100 <= round((found.worst[0].time_s - poses.time_s[0]) * 60) < 110
    gap = canonical_positions(poses)
    gap[:60] = np.nan
    known = differences(poses, Reference(poses.time_s, gap))
    assert known.frames[0] >= 60 and np.nanmax(known.mm) < 1e-6
    with refused(FormatError, "compare.no_instant"):
        differences(poses, Reference(poses.time_s + 100.0, canonical_positions(poses)))


def test_a_slide_in_the_reference_s_stance_is_another_figure_than_in_the_own(poses):
    """Feet that wander while they should stand slide in the reference's stance; in their own they never stand."""
    still = t_pose(180)
    wander = 0.1 * np.sin(2 * np.pi * still.time_s)[:, None, None] * np.array([1.0, 0.0, 0.0])
    lively = replace(still, positions_m=still.positions_m + wander)
    found = evaluate(lively, Reference(still.time_s, canonical_positions(still)))
    own = own_figures(lively)
    assert "foot_slide_cm_s" not in own
    assert found["foot_slide_cm_s"] == pytest.approx(40.0, rel=0.05)  # mean speed of 10 cm at 1 Hz
    assert found["own_stance_foot_slide_cm_s"] == own["own_stance_foot_slide_cm_s"] < 10.0


def test_figures_of_a_solve_alone(poses):
    some = frames_of(poses, slice(0, 361))
    calm = own_figures(some)
    assert calm["bone_length_sd_mm"] == 0.0 and calm["frames"] == some.frame_count
    tremor = 0.005 * np.sin(2 * np.pi * 12.0 * some.time_s)[:, None]
    shaken = replace(some, positions_m=some.positions_m + tremor[:, None] * np.array([1.0, 0.0, 0.0]))
    found = own_figures(shaken)
    # 5 mm at 12 Hz: an RMS of 3.5 mm, of which the filter leaves a twentieth
    assert np.hypot(calm["jitter_mm"], 3.4) == pytest.approx(found["jitter_mm"], rel=0.05)
    assert found["jerk_m_s3"] > calm["jerk_m_s3"]
    assert own_figures(some, start_s=float(some.time_s[0]) + 5.0)["frames"] == 61
