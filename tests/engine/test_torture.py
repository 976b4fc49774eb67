"""No lost limb, no flip: torture motions through the pipeline, with ideal and with noisy cameras."""

import numpy as np
import pytest

from studio.engine.animation.motion.torture import TORTURE_OFFSETS, TORTURES, arm_bent, leg_bent
from studio.engine.model.joints import INDEX, PARENTS
from tests.engine.torture import LOST_S, figures, solved

LARGEST_AXIS_TURN_DEG = 90.0
FASTEST_TURN_RAD_S = 40.0
LIMIT_TOLERANCE_DEG = 0.1


def assert_followed(motion, poses, mean_mm, fastest_rad_s=FASTEST_TURN_RAD_S):
    found = figures(motion, poses)
    assert found.finite
    assert found.lost_s <= LOST_S, found
    assert found.axis_turn_deg < LARGEST_AXIS_TURN_DEG, found
    assert found.turn_rad_s < fastest_rad_s, found
    assert found.excess_deg < LIMIT_TOLERANCE_DEG, found
    assert found.mean_mm < mean_mm, found


IDEAL = ("cartwheel", "hands_behind_back")


@pytest.mark.parametrize(
    "name", [name if name in IDEAL else pytest.param(name, marks=pytest.mark.long) for name in TORTURES]
)
def test_ideal_joints(name):
    """Short: two motions; with noisy joints the short form has all."""
    motion = TORTURES[name]()
    assert_followed(motion, solved(motion, seed=None), mean_mm=10.0)


@pytest.mark.parametrize("name", TORTURES)
def test_noisy_joints(name):
    motion = TORTURES[name]()
    assert_followed(motion, solved(motion, seed=1), mean_mm=25.0)


def test_noisy_joints_finished():
    """All of them: `test_all_finished`, long."""
    motion = TORTURES["cartwheel"]()
    assert_followed(motion, solved(motion, seed=1, preset="finish"), mean_mm=25.0)


def test_a_leg_that_is_faster_than_a_jump_is_followed():
    """A spike of the hip throws the leg off; its joints, at 8 m/s, were then taken for jumps for half a second."""
    motion = TORTURES["cartwheel"]()
    assert_followed(motion, solved(motion, "ik=previous_pose", seed=7), mean_mm=25.0)


@pytest.mark.long
@pytest.mark.parametrize("seed", [None, 1, 2, 3])
@pytest.mark.parametrize("name", TORTURES)
def test_all_finished(name, seed):
    motion = TORTURES[name]()
    assert_followed(motion, solved(motion, seed=seed, preset="finish"), mean_mm=25.0)


@pytest.mark.long
@pytest.mark.parametrize("ik", ["previous_pose", "kalman_filter"])
@pytest.mark.parametrize("seed", range(2, 8))
@pytest.mark.parametrize("name", TORTURES)
def test_noisy_joints_of_many_seeds(name, seed, ik):
    motion = TORTURES[name]()
    # spikes of the same wrist in both cameras at once turn a forearm faster than a performer would
    assert_followed(motion, solved(motion, f"ik={ik}", seed=seed), mean_mm=25.0, fastest_rad_s=50.0)


@pytest.mark.long
@pytest.mark.timeout(3000)
@pytest.mark.parametrize(
    ("preset", "ik"), [("studio", "previous_pose"), ("studio", "kalman_filter"), ("finish", "kalman_filter")]
)
@pytest.mark.parametrize("seed", [None, 1])
@pytest.mark.parametrize("bent", [arm_bent, leg_bent])
def test_a_limb_bent_a_thousand_times(bent, seed, preset, ik):
    motion = bent(1000)
    mean_mm = 8.0 if seed is None and preset == "studio" else 25.0
    poses = solved(motion, f"ik={ik}", seed=seed, preset=preset)
    assert_followed(motion, poses, mean_mm=mean_mm, fastest_rad_s=50.0)


@pytest.mark.parametrize("name", TORTURES)
def test_the_motions_are_a_humans(name):
    motion = TORTURES[name]()
    positions = motion.positions_m
    bones = np.linalg.norm(positions[:, 1:] - positions[:, PARENTS[1:]], axis=2)
    assert np.abs(bones - np.linalg.norm(TORTURE_OFFSETS[1:], axis=1)).max() < 1e-6
    speed = np.linalg.norm(np.diff(positions, axis=0), axis=2) / motion.frame_s
    assert speed.max() < 13
    assert positions[..., 2].min() > -0.02
    feet = positions[:, [INDEX["left_toe"], INDEX["right_toe"]], 2]
    assert name == "cartwheel" or feet.min(axis=1).max() < 0.03, "a foot is always on the floor"
