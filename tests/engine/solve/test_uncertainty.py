"""Radii and confidences: what increases them, and that they are right where the truth is known."""

import numpy as np
import pytest

from studio.engine.model.frames import FusedSkeleton
from studio.engine.model.joints import INDEX, JOINT_COUNT, MEASURED_JOINTS, OUTPUT_INDEX, OUTPUT_JOINTS
from studio.engine.model.joints import OUTPUT_OF_CANONICAL_INDEX as OUT
from studio.engine.model.settings.settings import parse_settings
from studio.engine.solve.uncertainty import BALL_90, CLOSE_M, OFFSET_M, Uncertainty
from studio.engine.whole_take.take import solve_frames
from tests.engine.walkers import arms_swinging, frame_set, recorded, stage

DT = 1 / 60
WRIST = INDEX["left_wrist"]


def output_of(joints):
    """Output joints, shape (52, 3), at these canonical ones; the rest are at the origin."""
    positions = np.zeros((len(OUTPUT_JOINTS), 3))
    positions[OUT] = joints
    return positions


def seen_by(cameras, fused=None):
    """A fused skeleton, by default the mean, in which every joint of a camera is used; cameras (count, 21, 3)."""
    seen = np.isfinite(cameras[..., 0])
    used = seen.any(axis=0)
    mean = np.where(seen[..., None], cameras, 0.0).sum(axis=0) / np.maximum(seen.sum(axis=0), 1)[:, None]
    mean[~used] = np.nan
    return FusedSkeleton(mean if fused is None else fused, used * 0.95, np.where(used, 0.01, np.nan), seen)


def after(cameras, *, frames=30, solved=None, fused=None, at=lambda k: 0.0, uncertainty=None, **seen):
    """Confidence and radius [mm] of the output joints after some frames of the same joints, moved by at(k) [m]."""
    uncertainty = uncertainty or Uncertainty(filtered=True, solved=True)
    joints = arms_swinging(0.0) if solved is None else solved
    for k in range(frames):
        moved = cameras + at(k)
        shown = frame_set(k * DT, moved, **seen)
        found = seen_by(moved, None if fused is None else fused + at(k))
        confidence, radius = uncertainty.of(output_of(joints + at(k)), found, shown, DT)
    return confidence, radius


def two(joints=None):
    return np.repeat((arms_swinging(0.0) if joints is None else joints)[None], 2, axis=0)


def test_no_joint_is_surer_than_the_offset_that_nobody_sees():
    _, radius = after(np.repeat(arms_swinging(0.0)[None], 4, axis=0))
    assert (radius >= 1e3 * BALL_90 * OFFSET_M).all()
    assert radius[OUTPUT_INDEX["Hips"]] < 40


def test_farther_joints_are_less_sure():
    radii = []
    for away in (0.0, 1.0, 2.0, 4.0):  # both cameras look from the front, -y
        joints = arms_swinging(0.0) + np.array([0.0, away, 0.0])
        radii.append(after(two(joints), solved=joints)[1])
    assert (np.diff(radii, axis=0) > 0).all()


def test_hidden_joints_are_less_sure_and_more_cameras_help():
    sure = np.full((2, JOINT_COUNT), 0.95)
    sure[:, WRIST] = 0.3
    hidden, seen = after(two(), confidence=sure), after(two())
    wrist, other = OUTPUT_INDEX["LeftHand"], OUTPUT_INDEX["RightHand"]
    assert hidden[1][wrist] > 1.5 * seen[1][wrist] and hidden[1][other] == seen[1][other]
    assert hidden[0][wrist] < seen[0][wrist]
    one = after(two()[:1])[1]
    four = after(np.repeat(two(), 2, axis=0))[1]
    assert (one > seen[1]).all() and (seen[1] > four).all()


def test_ends_of_limbs_are_less_sure_than_the_trunk():
    _, radius = after(two())
    names = ("LeftArm", "LeftForeArm", "LeftHand", "LeftHandMiddle1", "LeftHandIndex3")
    assert (np.diff([radius[OUTPUT_INDEX[name]] for name in names]) > 0).all()


def test_misfit_and_motion_add():
    apart = arms_swinging(0.0)
    apart[WRIST] += [0.0, 0.0, 0.05]
    wrist, other = OUTPUT_INDEX["LeftHand"], OUTPUT_INDEX["RightHand"]
    plain, misfit = after(two())[1], after(two(apart))[1]
    assert misfit[wrist] > max(50, plain[wrist]) and misfit[other] == pytest.approx(plain[other])
    fast = after(two(), at=lambda k: np.array([3.0 * DT * k, 0.0, 0.0]) - [0.75, 0.0, 0.0])[1]
    assert (fast[OUT] > plain[OUT] + 5).all()


def test_cameras_that_disagree_are_less_sure_but_mirrored_ones_are_not():
    joints, pair = arms_swinging(0.0), two()
    plain = after(pair, fused=joints)[1]
    pair[1, WRIST] += [0.0, 0.0, 0.3]
    assert after(pair, fused=joints)[1][OUTPUT_INDEX["LeftHand"]] > plain[OUTPUT_INDEX["LeftHand"]] + 50
    swapped = two()
    left, right = INDEX["left_wrist"], INDEX["right_wrist"]
    swapped[1, [left, right]] = swapped[1, [right, left]]
    assert after(swapped, fused=joints)[1] == pytest.approx(plain, rel=0.05)


def test_an_unseen_joint_grows_until_the_body_carries_it():
    """It shrinks again when the joint is seen again; its finger and no other joint follows it."""
    uncertainty = Uncertainty(filtered=True, solved=True)
    before = after(two(), uncertainty=uncertainty)[1]
    hidden = two()
    hidden[:, [WRIST, INDEX["left_hand"]]] = np.nan
    radii = [after(hidden, frames=1, uncertainty=uncertainty) for _ in range(60)]
    wrist, finger, other = (OUTPUT_INDEX[n] for n in ("LeftHand", "LeftHandRing2", "RightHand"))
    grown = np.array([radius for _, radius in radii])
    assert (np.diff(grown[:18, wrist]) > 0).all() and (np.diff(grown[:18, finger]) > 0).all()
    assert grown[20, wrist] > 400 and grown[-1, wrist] == pytest.approx(grown[20, wrist], rel=1e-3)
    assert grown[-1, other] == pytest.approx(before[other], rel=1e-3)
    assert radii[-1][0][wrist] == 0 and radii[-1][0][other] > 0.9
    assert after(two(), frames=1, uncertainty=uncertainty)[1][wrist] == pytest.approx(before[wrist], rel=0.01)


def test_what_was_never_seen_is_finite_and_unsure():
    nobody = np.full((2, JOINT_COUNT, 3), np.nan)
    confidence, radius = after(nobody, frames=3)
    assert np.isfinite(radius).all() and (radius > 100).all() and (confidence == 0).all()


def test_joints_between_measured_ones_are_between():
    _, radius = after(two())
    for joint, a, b in (("Spine", "Hips", "Spine1"), ("LeftShoulder", "Spine2", "LeftArm")):
        low, high = sorted(radius[[OUTPUT_INDEX[a], OUTPUT_INDEX[b]]])
        assert low - 1e-9 <= radius[OUTPUT_INDEX[joint]] <= high + 1e-9


def test_confidence_is_the_probability_of_being_close():
    """For a normal error with the reported radius."""
    confidence, radius = after(two())
    rng = np.random.default_rng(1)
    for joint in (OUTPUT_INDEX["Hips"], OUTPUT_INDEX["LeftHandMiddle1"], OUTPUT_INDEX["LeftHandIndex3"]):
        error = np.linalg.norm(rng.normal(0, radius[joint] / 1e3 / BALL_90, (40000, 3)), axis=1)
        assert confidence[joint] == pytest.approx((error < CLOSE_M).mean(), abs=0.01)
        assert (error < radius[joint] / 1e3).mean() == pytest.approx(0.9, abs=0.01)


def test_time_that_stands_still_changes_nothing():
    uncertainty = Uncertainty(filtered=True, solved=True)
    first = after(two(), uncertainty=uncertainty)[1]
    shown = frame_set(0.0, two())
    again = uncertainty.of(output_of(arms_swinging(0.0)), seen_by(two()), shown, 0.0)[1]
    assert again == pytest.approx(first, rel=1e-6)


def test_filters_and_bodies_average_noise_away():
    raw = after(two(), uncertainty=Uncertainty(filtered=False, solved=False))[1]
    solved = after(two(), uncertainty=Uncertainty(filtered=False, solved=True))[1]
    both = after(two(), uncertainty=Uncertainty(filtered=True, solved=True))[1]
    assert (raw > solved).all() and (solved > both).all()


@pytest.mark.parametrize("preset", ["studio", "thesis", "raw"])
def test_nine_tenths_of_the_joints_are_inside(preset):
    """Cameras with the expected noise: an offset per joint, and noise that is correlated from frame to frame."""
    calibration = stage(-35.0, 35.0)
    offset = np.random.default_rng(4).normal(0, 0.01, (JOINT_COUNT, 3))
    frames = list(recorded(calibration, lambda t: arms_swinging(t) + offset, 6.0, noise_m=0.015, seed=2))
    poses = solve_frames(frames, calibration, parse_settings(preset))
    joints = [INDEX[name] for name in MEASURED_JOINTS]
    error = [
        np.linalg.norm(p[OUT] - arms_swinging(t), axis=1)
        for p, t in zip(poses.positions_m, poses.time_s, strict=True)
    ]
    error, radius = 1e3 * np.array(error)[60:, joints], poses.uncertainty_mm[60:, OUT][:, joints]
    assert 0.8 < (error < radius).mean() < 0.98
    assert np.median(radius) < 2.3 * np.median(error)
    assert ((poses.confidence >= 0) & (poses.confidence <= 1)).all()
