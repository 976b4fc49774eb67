"""Legs that no camera reads hang down, are doubted, and are reported; the long form is `unread`."""

import numpy as np
import pytest

from tests.engine.seeing.tracker.unread import WAYS, part_of, run


@pytest.mark.parametrize(
    ("way", "why"), [("range", "range"), ("trousers", "no_depth"), ("table", "covered"), ("edge", "outside")]
)
def test_legs_that_are_not_read_hang_and_are_doubted(way, why):
    done = run(way, 0, "T-pose", seconds=0.8)
    assert not done.believed.any()
    ankles = done.error_m[:, [5, 11]]
    assert np.median(ankles) < 0.25, "legs hang below the hips"
    assert set(done.legs_unread[-1].values()) == {why}


def test_a_child_in_dark_trousers_is_found_by_what_is_left_of_it():
    done = run("trousers", 9, "T-pose", seconds=0.4)
    shoulders_and_elbows = done.error_m[4:, [0, 1, 6, 7]]
    assert np.median(shoulders_and_elbows) < 0.05 and not done.believed.any()


def test_feet_beyond_the_range_do_not_lift_the_body():
    done = run("range", 2, "swings", seconds=0.3)  # of a heavy body, little more than the feet
    assert np.median(done.error_m[5:, [4, 10]]) < 0.06, "knees"


def test_an_arm_that_may_be_folded_or_stretched_towards_the_camera_is_doubted():
    done = run("edge", 4, "swings", seconds=1.0)
    arm = done.error_m[:, :3] > 0.10
    assert arm.any() and not done.believed.any()


@pytest.mark.long
@pytest.mark.parametrize("way", WAYS)
def test_no_joint_is_off_and_believed(way):
    off = {seed: int(run(way, seed, part_of(way, seed)).believed.sum()) for seed in range(10)}
    assert not any(off.values()), off
