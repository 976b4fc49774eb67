"""Joints that a solve could not follow, from made-up poses and reports."""

from types import SimpleNamespace

import numpy as np
import pytest

from studio.engine.model.joints import INDEX, JOINT_COUNT, MIRROR, OUTPUT_JOINTS, OUTPUT_OF_CANONICAL_INDEX
from studio.engine.whole_take.residuals import (
    NOT_FOLLOWED_M,
    TOLD_S,
    SolveResiduals,
    distances_m,
    not_followed_mm,
)

DT_NS = 16_666_667
RNG = np.random.default_rng(1)
POSE = RNG.normal(0, 0.5, (len(OUTPUT_JOINTS), 3))
JOINTS = POSE[OUTPUT_OF_CANONICAL_INDEX]


def result(frame, *reports, pose=POSE):
    """A step's result: each camera's report, and the pose."""
    seen = np.array(reports)
    frames = SimpleNamespace(stage_time_ns=frame * DT_NS, positions=seen, rays=np.zeros(len(seen), bool))
    return SimpleNamespace(frame_set=frames, positions_m=pose)


def moved(name, by):
    joints = JOINTS.copy()
    joints[INDEX[name]] += by
    return joints


def test_the_nearest_camera_counts():
    far, near = moved("left_wrist", [0.5, 0, 0]), moved("left_wrist", [0, 0.1, 0])
    assert distances_m(result(0, far, near).frame_set, POSE)[INDEX["left_wrist"]] == pytest.approx(0.1)
    assert not_followed_mm(result(0, far, near)) == {}
    assert not_followed_mm(result(0, far, far)) == {"left_wrist": 500}


def test_a_camera_that_takes_left_for_right_reports_the_other_side():
    assert np.abs(distances_m(result(0, JOINTS[MIRROR]).frame_set, POSE)).max() < 1e-12


def test_joints_that_nobody_reports_are_neither_followed_nor_not():
    unseen = np.full((JOINT_COUNT, 3), np.nan)
    assert np.isnan(distances_m(result(0, unseen, unseen).frame_set, POSE)).all()
    hidden = JOINTS.copy()
    hidden[INDEX["left_toe"]] = np.nan
    distance = distances_m(result(0, hidden).frame_set, POSE)
    assert np.flatnonzero(np.isnan(distance)).tolist() == [INDEX["left_toe"]]


def test_the_furthest_joint_comes_first():
    both = moved("left_wrist", [0.3, 0, 0])
    both[INDEX["right_ankle"]] += [0, 0, 0.4]
    assert list(not_followed_mm(result(0, both)).items()) == [("right_ankle", 400), ("left_wrist", 300)]


def test_figures_of_a_take():
    residuals, far = SolveResiduals(), moved("left_wrist", [0, 0, 0.4])
    for k in range(60):
        residuals.add(result(k, far if 20 <= k < 50 else JOINTS))
    wrist = residuals.joints()["left_wrist"]
    assert wrist.share == pytest.approx(0.5)
    assert wrist.longest_s == pytest.approx(0.5, abs=0.02)
    assert wrist.largest_mm == pytest.approx(400)
    assert residuals.joints()["hips"].largest_mm == 0
    assert (
        residuals.line()
        == "could not follow left_wrist 50.0 % of the time (0.5 s at a stretch, up to 400 mm off)"
    )


def test_what_is_not_followed_for_short_but_often_is_told():
    residuals, far = SolveResiduals(), moved("left_wrist", [0, 0, 0.4])
    for k in range(240):
        residuals.add(result(k, far if k % 24 < 6 else JOINTS))
    assert residuals.joints()["left_wrist"].longest_s < TOLD_S
    assert residuals.line().startswith("could not follow left_wrist 25.0 % of the time")


def test_a_spike_left_out_is_not_told():
    residuals, far = SolveResiduals(), moved("left_wrist", [0, 0, NOT_FOLLOWED_M + 0.1])
    for k in range(60):
        residuals.add(result(k, far if k == 30 else JOINTS))
    assert residuals.line() == "all joints"
    assert residuals.joints()["left_wrist"].largest_mm == pytest.approx(250)


def test_nobody_and_jumps_are_told():
    residuals = SolveResiduals()
    for k in range(60):
        there = np.array([2.0 if k >= 50 else 0.0, 0, 0])
        reports = JOINTS + there if k < 20 or k >= 40 else np.full((JOINT_COUNT, 3), np.nan)
        residuals.add(result(k, reports, pose=POSE + there))
    assert residuals.line() == "saw nobody for up to 0.3 s; jumped to somebody elsewhere once"
    assert residuals.figures()["jumps"] == 1


def test_nothing_added_is_nothing_to_tell():
    assert SolveResiduals().figures()["jumps"] == 0
