"""Front and back: the pose turned round, when it is tried, and a body followed front for back set right."""

import numpy as np
import pytest

from studio.engine.joints import INDEX
from studio.engine.motion.torture import arms_crossed
from studio.engine.tracker.body import SHAPE, humanoid_of
from studio.engine.tracker.chain import Pose, chain_of
from studio.engine.tracker.facing import FacingWatch, joints_of, turned_round
from studio.engine.tracker.fit import Figure, Fitter
from studio.engine.tracker.motion import Motion
from studio.engine.tracker.start import heading
from studio.engine.tracker.tracker import Tracker
from tests.engine.tracker.scenes import LIMBS, simulated

AHEAD = np.array([[0.0, 1.0]])
"""A camera that looks along +y sees the front of a body that faces -y."""
FACING = Pose(np.array([0.0, 0.0, 0.9]), np.eye(3), np.zeros(1))


@pytest.fixture(scope="module")
def usual():
    figure = Figure.of(np.zeros(len(SHAPE)))
    fitter = Fitter(*chain_of(humanoid_of(figure.shape)))
    return figure, fitter, Motion(fitter.limits).posture


def test_turned_round_the_sides_are_exchanged(usual):
    figure, fitter, posture = usual
    pose = Pose(np.array([0.1, 0.2, 0.9]), np.eye(3), fitter.limits.rest.copy())
    turned = turned_round(fitter, figure, pose, posture)
    assert abs(abs(heading(turned)) - np.pi) < 0.2
    before, after = (joints_of(fitter, figure, p)[0] for p in (pose, turned))
    for joint in ("shoulder", "hip", "ankle"):
        assert np.linalg.norm(before[INDEX[f"left_{joint}"]] - after[INDEX[f"right_{joint}"]]) < 0.06
    toes = [j[INDEX["left_toe"]] - j[INDEX["left_ankle"]] for j in (before, after)]
    assert toes[0][1] < -0.05 and toes[1][1] > 0.05


def test_tests_in_a_row_decide():
    watch = FacingWatch()
    assert [watch.told(1.0, 0.3) for _ in range(3)] == [False, False, True]
    assert not any(watch.told(1.0, 1.2) for _ in range(5))
    assert [watch.told(1.0, 0.8) for _ in range(4)] == [False, False, False, True]


def test_it_is_tried_more_often_where_a_side_was_seen():
    def frames(pose):
        watch = FacingWatch()
        return sum(watch.due(pose, AHEAD) for _ in range(600))

    sideways = Pose(
        FACING.root, np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]), FACING.angles
    )
    assert frames(FACING) < 40 and frames(sideways) == 150


def test_a_body_followed_front_for_back_is_set_right():
    cameras, placed, sets, truth = simulated(arms_crossed(), end_s=1.0)
    tracker = Tracker(cameras, placed)
    for images in sets[:6]:
        tracker.track(images)
    turned = turned_round(tracker._fitter, tracker._figure, tracker._motion.pose, tracker._motion.posture)
    tracker._motion.restart(turned)
    skeletons = [tracker.track(images) for images in sets[6:]]
    error = np.linalg.norm(skeletons[-1].positions - truth[-1], axis=1)[LIMBS].mean()
    assert error < 0.08
