"""What is reported about a wrong T-pose."""

import numpy as np
import pytest

from studio.engine.calibration.cameras.merge import Walk
from studio.engine.calibration.performer.tpose import find_tpose, tpose_problems
from studio.engine.model.human.anthropometry import anthropometric_positions
from studio.engine.model.joints import INDEX

UP = np.array([0.0, 0.0, 1.0])


def held(change=None) -> np.ndarray:
    """A second of a T-pose at 30 Hz with noise, one joint moved by `change(instant, joints)`."""
    rng = np.random.default_rng(1)
    joints = np.tile(anthropometric_positions(1.75), (30, 1, 1)) + rng.normal(0, 0.003, (30, 21, 3))
    for i, mine in enumerate(joints):
        if change is not None:
            change(i, mine)
    return joints


def bent(_, joints):
    joints[INDEX["left_wrist"]] = joints[INDEX["left_elbow"]] + [0.02, -0.25, 0]


def low(_, joints):
    joints[INDEX["right_elbow"]] = joints[INDEX["right_shoulder"]] + [-0.2, 0, -0.2]
    joints[INDEX["right_wrist"]] = joints[INDEX["right_shoulder"]] + [-0.4, 0, -0.4]


def forwards(_, joints):
    joints[INDEX["left_elbow"]] = joints[INDEX["left_shoulder"]] + [0.2, -0.22, 0]
    joints[INDEX["left_wrist"]] = joints[INDEX["left_shoulder"]] + [0.4, -0.44, 0]


def waving(i, joints):
    joints[INDEX["right_wrist"]] += [0, 0.1 * np.sin(i / 30 * 2 * np.pi), 0]


def unseen(_, joints):
    joints[INDEX["left_wrist"]] = np.nan


def test_a_good_one_has_no_problem():
    assert tpose_problems(held(), UP, 30.0) == []


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (bent, "left arm bent"),
        (low, "right arm too low"),
        (forwards, "left arm not out sideways"),
        (waving, "right arm moves"),
        (unseen, "left arm not seen"),
    ],
)
def test_a_poor_one_says_which(change, words):
    problems = tpose_problems(held(change), UP, 30.0)
    assert len(problems) == 1
    assert problems[0].startswith(words)


@pytest.mark.parametrize("count", [3, 15, 40])
def test_a_walk_that_is_shorter_than_what_is_smoothed_over_has_no_t_pose(count):
    joints = held()[np.arange(count) % 30]
    walk = Walk(np.arange(count) / 100, joints[None], np.ones((1, count, 21)), joints)
    assert find_tpose(walk, UP) is None
