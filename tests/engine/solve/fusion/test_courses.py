"""Courses: how long a joint has moved without a jump in one camera."""

import numpy as np
import pytest

from studio.engine.model.joints import JOINT_COUNT
from studio.engine.solve.fusion.courses import GAP_S, Courses

SEEN = np.ones((1, JOINT_COUNT), dtype=bool)


def follow(courses, places, dt, seen=SEEN, sigma_m=0.02):
    noise = np.tile(sigma_m**2 * np.eye(3), (1, JOINT_COUNT, 1, 1))
    for place in places:
        steady = courses.follow(np.full((1, JOINT_COUNT, 3), place), noise, seen, dt)
    return steady[0, 0]


@pytest.mark.parametrize("hz", [30, 60, 120])
def test_a_fast_joint_is_steady_and_a_jump_is_not(hz):
    courses, dt = Courses(1), 1 / hz
    swing = 0.3 * np.sin(2 * np.pi * 1.0 * np.arange(hz) * dt)  # 3.3 m/s, 20 m/s2
    assert follow(courses, swing, dt) > 0.9
    assert follow(courses, [swing[-1] + 0.25], dt) == 0.0


def test_a_short_gap_is_bridged_and_a_long_one_begins_anew():
    for gap_s, steady in ((0.5 * GAP_S, True), (2 * GAP_S, False)):
        courses = Courses(1)
        before = follow(courses, np.zeros(30), 1 / 60)
        after = follow(courses, [0.0] * round(gap_s * 60), 1 / 60, seen=~SEEN)
        assert after == before
        assert (follow(courses, [0.0], 1 / 60) > before) == steady


def test_what_is_noisy_may_jitter():
    wobble = 0.025 * np.array([1, -1] * 10)
    assert follow(Courses(1), wobble, 1 / 60) == 0.0
    assert follow(Courses(1), wobble, 1 / 60, sigma_m=0.3) > 0.2
