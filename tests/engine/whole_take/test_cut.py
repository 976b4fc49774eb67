"""A performance that begins with a cut: its first second is as good as the rest."""

from dataclasses import replace

import numpy as np
import pytest

from studio.engine.model.joints import OUTPUT_OF_CANONICAL_INDEX
from studio.engine.model.settings.settings import parse_settings
from studio.engine.whole_take.cut import cut_between_s
from studio.engine.whole_take.take import solve_frames
from tests.engine.walkers import SECOND, arms_swinging, camera_frame, recorded, stage

CUT_S = 2.0
ELSEWHERE = np.array([1.2, -0.6, 0.0])


def cut(time_s):
    """A performer who stands elsewhere until the cut."""
    return arms_swinging(time_s) + (time_s < CUT_S) * ELSEWHERE


def errors_m(poses):
    """Error of each frame's worst joint [m], and whether the frame is of the first second."""
    truth = np.array([arms_swinging(t) for t in poses.time_s])
    error = np.linalg.norm(poses.positions_m[:, OUTPUT_OF_CANONICAL_INDEX] - truth, axis=2).max(axis=1)
    return error, poses.time_s < CUT_S + 1.0


@pytest.mark.parametrize("late_ms", [0, 12, 30])
@pytest.mark.parametrize("preset", ["thesis", "studio", "finish"])
def test_the_first_second_is_as_good_as_the_rest(preset, late_ms):
    """One camera's clock is assumed off by some milliseconds."""
    calibration = stage(-35.0, 35.0)
    frames = [
        replace(f, device_time_ns=f.device_time_ns + (late_ms * SECOND // 1000 if f.camera == "b" else 0))
        for f in recorded(calibration, cut, 2.5, noise_m=0.01, seed=2, start_s=1.028)
    ]
    poses = solve_frames(frames, calibration, parse_settings(preset), start_s=CUT_S)
    error, first = errors_m(poses)
    assert CUT_S <= poses.time_s[0] <= CUT_S + 0.08
    assert error[first].max() < max(2.0 * error[~first].max(), 0.1)


def frames_of(positions, times_s):
    """A camera's frames of joints on the stage."""
    calibration = stage(0.0)
    return [camera_frame(calibration, "a", t, p) for t, p in zip(times_s, positions, strict=True)]


def test_a_cut_is_found_where_it_is():
    times_s = np.arange(0.005, 0.5, 1 / 30)
    moved = [arms_swinging(t) + (k < 2) * ELSEWHERE for k, t in enumerate(times_s)]
    assert cut_between_s(frames_of(moved, times_s), times_s) == pytest.approx(tuple(times_s[1:3]))
    late = [arms_swinging(t) + (k < 8) * ELSEWHERE for k, t in enumerate(times_s)]
    assert cut_between_s(frames_of(late, times_s), times_s) is None, "that is no cut of the start"


def test_who_was_lost_at_the_cut_was_cut():
    times_s = np.arange(0.005, 0.5, 1 / 30)
    lost = [arms_swinging(t) + (k < 1) * ELSEWHERE for k, t in enumerate(times_s)]
    lost[1:9] = [np.full_like(lost[0], np.nan)] * 8
    assert cut_between_s(frames_of(lost, times_s), times_s) == pytest.approx((times_s[0], times_s[9]))


def test_who_runs_and_swings_was_not_cut():
    rng = np.random.default_rng(1)
    times_s = np.arange(0.005, 0.5, 1 / 30)
    running = [arms_swinging(8 * t) + np.array([9.0 * t, 0.0, 0.0]) for t in times_s]
    noisy = [p + 0.015 * rng.normal(size=p.shape) for p in running]
    assert cut_between_s(frames_of(noisy, times_s), times_s) is None
    assert cut_between_s([], np.zeros(0)) is None
