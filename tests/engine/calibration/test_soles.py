"""Heights of the soles: measured where feet stand, kept in the T-pose, and used by finishing and by exports."""

from dataclasses import replace

import numpy as np
import pytest

from studio.engine.animation.clip.skeleton import local_motion
from studio.engine.animation.motion.proportions import AUTHORED_OFFSETS
from studio.engine.calibration.cameras.merge import Walk
from studio.engine.calibration.performer.soles import on_soles
from studio.engine.model.calibration import Calibration, CameraCalibration, Performer
from studio.engine.model.human.skeleton import Skeleton
from studio.engine.model.joints import INDEX, OUTPUT_INDEX, PARENTS
from studio.engine.model.poses import Poses
from studio.engine.model.soles import rest_lift_m
from studio.engine.whole_take.finish.contact.contacts import find_contacts
from tests.poses_factory import t_pose

PERFORMER = Performer(1.78, AUTHORED_OFFSETS)


def _standing(ankle_m: float, toe_m: float, *, noise_m: float = 0.0, frames: int = 300) -> Walk:
    """A performer who stands with ankles and toes at these heights."""
    rest = AUTHORED_OFFSETS.copy()
    for joint, parent in enumerate(PARENTS):
        if parent >= 0:
            rest[joint] += rest[parent]
    for side in ("left", "right"):
        rest[INDEX[f"{side}_ankle"], 2], rest[INDEX[f"{side}_toe"], 2] = ankle_m, toe_m
    joints = rest + np.random.default_rng(1).normal(0.0, noise_m, (frames, 21, 3))
    return Walk(np.arange(frames) / 30, joints[None], np.ones((1, frames, 21)), joints)


def _heights(performer: Performer) -> tuple[float, float]:
    rest = Skeleton.of(performer).rest_positions_m
    return float(rest[OUTPUT_INDEX["LeftFoot"], 2]), float(rest[OUTPUT_INDEX["RightToeBase"], 2])


@pytest.mark.parametrize(("ankle_m", "toe_m"), [(0.075, 0.035), (0.105, 0.05), (0.09, 0.015)])
def test_heights_are_those_of_standing_feet(ankle_m, toe_m):
    found = on_soles(PERFORMER, _standing(ankle_m, toe_m, noise_m=0.005))
    assert found.soles_measured
    assert _heights(found) == pytest.approx((ankle_m, toe_m), abs=0.004)
    assert found.bones_m() == pytest.approx(PERFORMER.bones_m())


def test_who_did_not_place_the_floor_stands_on_the_lowest_level():
    """Example: the T-pose was recorded above the floor of the rest."""
    above, below = _standing(0.13, 0.085, noise_m=0.004), _standing(0.06, 0.02, noise_m=0.004, frames=60)
    joints = np.concatenate([above.positions[0], below.positions[0]])
    both = Walk(np.arange(len(joints)) / 30, joints[None], np.ones((1, len(joints), 21)), joints)
    assert _heights(on_soles(PERFORMER, both, lowest=True)) == pytest.approx((0.06, 0.02), abs=0.006)
    assert _heights(on_soles(PERFORMER, both))[0] > 0.12


def test_they_stay_within_sane_bounds():
    ankle, toe = _heights(on_soles(PERFORMER, _standing(0.30, 0.26)))
    assert ankle <= 0.08 * 1.78 + 1e-9 and 0.0 < toe < ankle


def test_a_dancer_on_her_toes_and_a_short_glimpse_tell_nothing():
    assert on_soles(PERFORMER, _standing(0.17, 0.03)) is PERFORMER
    assert on_soles(PERFORMER, _standing(0.08, 0.03, frames=20)) is PERFORMER


def test_feet_that_never_stand_tell_nothing():
    """Example: one camera alone guesses the places. There is no warning either."""
    walk = _standing(0.08, 0.03)
    moving = walk.positions[0] + np.arange(300)[:, None, None] / 30 * [2.0, 0.0, 0.0]
    assert on_soles(PERFORMER, replace(walk, positions=moving[None], merged=moving)) is PERFORMER


def test_they_are_kept_with_the_calibration_and_old_ones_are_read():
    camera = {"camera_0": CameraCalibration(np.eye(4))}
    kept = Calibration("camera_0", camera, replace(PERFORMER, soles_measured=True), floor_given=True)
    again = Calibration.from_json(kept.to_json())
    assert again.floor_given and again.performer is not None and again.performer.soles_measured
    value = kept.to_json()
    del value["floor_given"], value["performer"]["soles_measured"]
    old = Calibration.from_json(value)
    assert not old.floor_given and old.performer is not None and old.performer.soles_measured


def test_exports_stand_on_them(tmp_path):
    lowest = min(t_pose().positions_m[0, :, 2])
    root = float(t_pose().positions_m[0, 0, 2])
    poses = replace(t_pose(3), root_height_m=root - lowest + 0.033)
    poses.save(tmp_path / "poses.npz")
    read = Poses.load(tmp_path / "poses.npz")
    assert read.root_height_m == poses.root_height_m
    assert local_motion(read).rest_positions_m[:, 1].min() == pytest.approx(0.033)
    assert local_motion(t_pose(3)).rest_positions_m[:, 1].min() == pytest.approx(0.02)


def test_the_height_of_another_body_is_not_believed():
    assert rest_lift_m([0.0, -0.9], 0.93) == pytest.approx(0.93)
    assert rest_lift_m([0.0, -0.9], 0.80) == rest_lift_m([0.0, -0.9], 1.20) == pytest.approx(0.92)


def test_a_floor_that_is_given_stays_the_floor():
    rest_m = np.array([0.08, 0.03, 0.08, 0.03])
    feet = np.zeros((60, 4, 3))
    feet[:, :, 2] = rest_m - 0.03
    assert find_contacts(feet, [(0, 60)], 1 / 60, rest_m).floor_m == pytest.approx(-0.03, abs=0.001)
    given = find_contacts(feet, [(0, 60)], 1 / 60, rest_m, floor_given=True)
    assert given.floor_m == 0.0 and (given.place_m[:, :, 2] >= 0.75 * rest_m - 1e-9).all()
