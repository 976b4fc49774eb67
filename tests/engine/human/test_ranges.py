"""Ranges of motion: sane, mirrored, and scaled by flexibility."""

import numpy as np
import pytest

from studio.engine.human.ranges import DOFS, dofs_of, range_rad
from studio.engine.joints import OUTPUT_JOINTS

ALL = [(joint, dof) for joint, dofs in DOFS.items() for dof in dofs]


@pytest.mark.parametrize(("joint", "dof"), ALL, ids=[f"{joint}-{dof.name}" for joint, dof in ALL])
def test_every_hinge_is_sane(joint, dof):
    assert joint in OUTPUT_JOINTS
    assert np.linalg.norm(dof.axis) == pytest.approx(1.0)
    assert -180 < dof.low_deg < 0 < dof.high_deg < 180, "the T-pose is within the range"
    assert dof.low_deg <= dof.rest_deg <= dof.high_deg
    low, high = np.degrees(range_rad(dof, 1.0))
    assert (low, high) == pytest.approx((dof.low_deg, dof.high_deg))


def test_the_right_side_mirrors_the_left():
    for joint in DOFS:
        if joint.startswith("Left"):
            for left, right in zip(dofs_of(joint), dofs_of("Right" + joint[4:]), strict=True):
                assert right.axis == pytest.approx(tuple(np.array(left.axis) * [1, -1, -1]))
                assert (right.low_deg, right.high_deg) == (left.low_deg, left.high_deg)


def test_fingers_and_hips_have_no_hinges():
    assert dofs_of("Hips") == () and dofs_of("LeftHandIndex1") == () and dofs_of("RightHandIndex1") == ()


def test_flexibility_scales_but_for_a_straight_knee():
    knee = DOFS["LeftLeg"][0]
    stiff, adult, gymnast = (np.degrees(range_rad(knee, f)) for f in (0.0, 1.0, 2.0))
    assert [stiff[0], adult[0], gymnast[0]] == pytest.approx([-3, -3, -3])
    assert stiff[1] < adult[1] < gymnast[1]
