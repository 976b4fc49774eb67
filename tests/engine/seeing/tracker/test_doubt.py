"""When the tracking of a body starts again, and that a turning body is expected to continue its turn."""

import numpy as np
import pytest

from studio.engine.seeing.fitting.chain import Pose, chain_of, rotation_of
from studio.engine.seeing.fitting.cones import SHAPE, humanoid_of
from studio.engine.seeing.fitting.fit import BodyShape, MeasuredPoints
from studio.engine.seeing.fitting.prediction import PosePredictor
from studio.engine.seeing.search.doubt import Doubt
from studio.engine.seeing.search.jumps import Jumps
from studio.engine.seeing.search.start import heading, standing

WELL = {"explained": 1.0, "worst_limb_m2": 0.0, "sure": 0.9}
BADLY = {"explained": 0.6, "worst_limb_m2": 0.0, "sure": 0.9}


def turns(doubt, frames, state, turning=False):
    return [len(doubt.turns(**state, turning=turning)) for _ in range(frames)]


def test_who_is_followed_well_is_left_alone():
    assert not any(turns(Doubt(), 50, WELL))


def test_after_some_frames_in_doubt_headings_are_tried_one_by_one_then_comes_a_pause():
    assert turns(Doubt(), 60, BADLY) == [0] * 7 + [1] * 8 + [0] * 40 + [1] * 5


def test_a_jump_tries_all_headings_at_once():
    doubt = Doubt()
    turns(doubt, 20, WELL)
    assert turns(doubt, 2, WELL | {"sure": 0.1}) == [8, 0]


def test_in_a_turn_one_heading_after_the_other_is_tried():
    doubt = Doubt()
    found = [float(np.degrees(doubt.turns(**WELL, turning=True)[0])) for _ in range(3)]
    assert found == pytest.approx([0.0, 180.0, 45.0])
    doubt.turned()
    assert doubt.turns(**WELL, turning=True) == pytest.approx([0.0])


def test_who_explains_next_to_nothing_for_long_is_lost():
    doubt = Doubt()
    turns(doubt, 80, WELL | {"explained": 0.3})
    assert not doubt.lost
    turns(doubt, 2, WELL | {"explained": 0.3})
    assert doubt.lost


def test_a_jump_fades_within_about_half_a_second_however_far_it_was():
    jumps = Jumps(2)
    jumps.told(np.zeros((2, 3)), np.diag([0.7, 0.1, 0.0])[:2])
    for _ in range(16):
        jumps.fade()
    assert 0.06 < jumps.lately_m[0] < 0.067 and jumps.lately_m[1] < 0.04


def test_who_turns_is_expected_to_turn_on():
    _, limits = chain_of(humanoid_of(np.zeros(len(SHAPE))))
    motion = PosePredictor(limits)
    pose = Pose(np.array([0.0, 0.0, 0.9]), np.eye(3), limits.rest)
    motion.restart(pose)
    information = np.eye(len(motion.velocity))
    for _ in range(15):
        pose = Pose(pose.root, rotation_of(np.array([0.0, 0.0, 0.05])) @ pose.rotation, pose.angles)
        motion.update(pose, information, 1 / 30)
    motion.update(pose, information, 1 / 30)  # one image that did not show the turn
    assert heading(motion.after(1 / 30)) - heading(pose) == pytest.approx(0.7 * 0.05, rel=0.02)


def test_from_the_side_a_body_begins_deeper_behind_its_points():
    figure = BodyShape.of(np.zeros(len(SHAPE)))
    _, limits = chain_of(humanoid_of(figure.shape))
    places = np.column_stack([np.zeros(40), np.full(40, -1.0), np.linspace(0.8, 1.2, 40)])
    views = np.tile([0.0, -1.0, 0.0], (40, 1))
    points = MeasuredPoints(places, views, np.zeros((40, 3)), np.zeros(40, np.int64))
    front, side = (standing(figure, points, yaw, limits.rest).root[1] for yaw in (0.0, np.pi / 2))
    assert front == pytest.approx(-0.91) and side == pytest.approx(-0.84)
