"""Joints that touch the floor or another joint have known places."""

import numpy as np
import pytest

from studio.engine.edits.edit import ContactEdit
from studio.engine.edits.touches import Touches
from studio.engine.model.joints import INDEX, JOINT_COUNT
from studio.engine.solve.touching import THICK, TouchingNow, with_touches

HEIGHT_M, FLOOR_M = 1.8, 0.02
HAND, HIP, KNEE = INDEX["left_hand"], INDEX["left_hip"], INDEX["right_knee"]
TIMES = np.arange(60) / 60


def touches() -> Touches:
    at = {"start_s": 0.4, "end_s": 0.6}
    return Touches(
        [
            ContactEdit(id="a", joint="left_hand", touches="left_hip", **at),
            ContactEdit(id="b", joint="right_knee", **at),
            ContactEdit(id="c", joint="left_toe", **at),
            ContactEdit(id="d", joint="right_hand", touches="left_hand", other="performer_2", **at),
        ]
    )


def test_a_joint_lies_on_the_floor_or_touches_another_for_as_long_as_it_is_said():
    sites = np.random.default_rng(0).normal(size=(60, JOINT_COUNT, 3))
    told = touches().at(TIMES)
    assert [(one.joint, one.touched) for one in told] == [(HAND, HIP), (KNEE, None)]
    lies_at = [sites[:, HAND, :2], np.tile([0.3, 0.4], (60, 1))]
    known = with_touches(None, told, sites, lies_at, floor_m=FLOOR_M, height_m=HEIGHT_M)
    assert known.information[30, HAND] > 0.0 and not known.information[0].any()
    away = known.place_m[30, HAND] - sites[30, HIP]
    assert np.linalg.norm(away) == pytest.approx(HEIGHT_M * (THICK[HAND] + THICK[HIP]))
    assert np.cross(away, sites[30, HAND] - sites[30, HIP]) == pytest.approx(np.zeros(3), abs=1e-9)
    assert known.place_m[30, KNEE] == pytest.approx([0.3, 0.4, FLOOR_M + HEIGHT_M * THICK[KNEE]])


def test_frame_by_frame_a_joint_stays_where_it_came_down():
    now, said = TouchingNow(HEIGHT_M), touches()
    for k in range(25, 35):
        sites = np.full((JOINT_COUNT, 3), 0.01 * k)
        known = now.known(None, said.now(k / 60), sites, FLOOR_M)
        assert known.place_m[KNEE, :2] == pytest.approx([0.25, 0.25])
