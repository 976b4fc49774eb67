"""Ranges of motion: sane, mirrored, and scaled by flexibility."""

import numpy as np
import pytest

from studio.engine.model.human.ranges import DOFS, dofs_of, range_rad
from studio.engine.model.joints import FINGERS, OUTPUT_JOINTS

ALL = [(joint, dof) for joint, dofs in DOFS.items() for dof in dofs]


@pytest.mark.parametrize(("joint", "dof"), ALL, ids=[f"{joint}-{dof.name}" for joint, dof in ALL])
def test_every_hinge_is_sane(joint, dof):
    assert joint in OUTPUT_JOINTS
    assert np.linalg.norm(dof.axis) == pytest.approx(1.0)
    assert -180 < dof.low_deg <= 0 < dof.high_deg < 180, "the T-pose is within the range"
    assert dof.low_deg <= dof.rest_deg <= dof.high_deg
    low, high = np.degrees(range_rad(dof, 1.0))
    assert (low, high) == pytest.approx((dof.low_deg, dof.high_deg))


def test_the_right_side_mirrors_the_left():
    for joint in DOFS:
        if joint.startswith("Left"):
            for left, right in zip(dofs_of(joint), dofs_of("Right" + joint[4:]), strict=True):
                assert right.axis == pytest.approx(tuple(np.array(left.axis) * [1, -1, -1]))
                assert (right.low_deg, right.high_deg) == (left.low_deg, left.high_deg)


def test_only_the_free_hips_have_no_hinges():
    assert [joint for joint in OUTPUT_JOINTS if not dofs_of(joint)] == ["Hips"]


@pytest.mark.parametrize("side", ["Left", "Right"])
def test_a_hand_has_twenty_hinges_in_anatomical_order(side):
    counts = [[len(dofs_of(f"{side}Hand{finger}{k}")) for k in (1, 2, 3)] for finger in FINGERS]
    assert counts == [[2, 1, 1]] * 5, "thumb: CMC 2, MCP 1, IP 1; fingers: MCP 2, PIP 1, DIP 1"


def test_flexibility_scales_but_for_a_straight_knee():
    knee = DOFS["LeftLeg"][0]
    stiff, adult, gymnast = (np.degrees(range_rad(knee, f)) for f in (0.0, 1.0, 2.0))
    assert [stiff[0], adult[0], gymnast[0]] == pytest.approx([-3, -3, -3])
    assert stiff[1] < adult[1] < gymnast[1]


def test_spans_of_shared_joints_add_up_to_the_sources():
    """Sums of AAOS for the back, except its bending (White & Panjabi: 150), and of AMA for the neck."""
    spine = [dofs_of(name) for name in ("Spine", "Spine1", "Spine2")]
    neck = [dofs_of(name) for name in ("Neck", "Head")]
    for joints, spans in ((spine, ((50, 100), (35, 35), (45, 45))), (neck, ((60, 50), (45, 45), (80, 80)))):
        for k, (low, high) in enumerate(spans):
            assert sum(dofs[k].low_deg for dofs in joints) == pytest.approx(-low, abs=6)
            assert sum(dofs[k].high_deg for dofs in joints) == pytest.approx(high, abs=6)


def test_no_range_reaches_half_a_turn_however_flexible():
    for _, dof in ALL:
        assert np.abs(np.degrees(range_rad(dof, 2.0))).max() < 180
