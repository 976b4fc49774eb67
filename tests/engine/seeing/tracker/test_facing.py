"""Front and back: the reversed pose, when it is tried, and the correction of a body tracked the wrong way round."""

from dataclasses import replace

import numpy as np
import pytest

from studio.engine.animation.motion.torture import arms_crossed
from studio.engine.model.joints import INDEX
from studio.engine.seeing.fitting.chain import Pose, chain_of
from studio.engine.seeing.fitting.cones import SHAPE, humanoid_of
from studio.engine.seeing.fitting.fit import BodyShape, Fitter
from studio.engine.seeing.fitting.prediction import PosePredictor
from studio.engine.seeing.search.facing import FacingWatch, aside_of, joints_of, turned_round
from studio.engine.seeing.search.start import heading
from studio.engine.seeing.tracker.heads import Heads
from studio.engine.seeing.tracker.tracker import Tracker
from studio.engine.seeing.tracker.view import CameraView
from studio.simulator.body.performers import TUNING
from tests.engine.seeing.tracker.scenes import LIMBS, simulated

AHEAD = np.array([[0.0, 1.0]])
"""A camera that looks along +y sees the front of a body that faces -y."""
FACING = Pose(np.array([0.0, 0.0, 0.9]), np.eye(3), np.zeros(1))


@pytest.fixture(scope="module")
def usual():
    figure = BodyShape.of(np.zeros(len(SHAPE)))
    fitter = Fitter(*chain_of(humanoid_of(figure.shape)))
    return figure, fitter, PosePredictor(fitter.limits).posture


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
    assert [watch.told(1.0, 0.3, 0.0) for _ in range(3)] == [False, False, True]
    assert not any(watch.told(1.0, 1.2, 0.0) for _ in range(5))
    assert [watch.told(1.0, 0.8, 0.0) for _ in range(4)] == [False, False, False, True]


def test_a_head_that_faces_the_other_way_decides():
    assert sum(FacingWatch().told(1.0, 1.3, -0.3) for _ in range(20)) == 0  # hardly anything is known
    watch = FacingWatch()
    assert any(watch.told(1.0, 1.3, -0.9) for _ in range(8))
    watch = FacingWatch()
    assert not any(watch.told(1.0, 0.8, 0.9) for _ in range(20))  # it faces ahead: the body is right


def test_it_is_tried_more_often_where_a_side_was_seen():
    def frames(pose, ahead=0.0):
        watch = FacingWatch()
        return sum(watch.due(pose, AHEAD, ahead if watch.looks() else None) for _ in range(600))

    sideways = Pose(
        FACING.root, np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]), FACING.angles
    )
    assert frames(FACING) < 40 and frames(sideways) == 150 == frames(FACING, ahead=-0.9)


def test_a_body_followed_front_for_back_is_set_right():
    cameras, placed, sets, truth = simulated(arms_crossed(), end_s=1.0)
    tracker = Tracker(cameras, placed)
    for images in sets[:6]:
        tracker.track(images)
    turned = turned_round(
        tracker.bodies[0].fitter,
        tracker.bodies[0].figure,
        tracker.bodies[0].motion.pose,
        tracker.bodies[0].motion.posture,
    )
    tracker.bodies[0].motion.restart(turned)
    skeletons = [tracker.track(images) for images in sets[6:]]
    error = np.linalg.norm(skeletons[-1].positions - truth[-1], axis=1)[LIMBS].mean()
    assert error < 0.08


def test_a_head_tells_how_far_aside_a_body_is_taken_to_face():
    assert aside_of(np.array([0.0, -0.9]), FACING) == pytest.approx(0.0)  # FACING faces -y
    assert aside_of(np.array([0.9, 0.0]), FACING) == pytest.approx(np.pi / 2)
    assert aside_of(np.array([-0.9, 0.0]), FACING) == pytest.approx(-np.pi / 2)
    assert aside_of(np.array([0.3, 0.0]), FACING) is None  # hardly anything is known


def test_a_body_is_tried_where_the_head_faces_aside_and_on_both_sides_of_it_in_doubt():
    watch, ahead = FacingWatch(), np.array([0.0, -0.9])
    assert watch.to_try(np.array([0.9, 0.0]), FACING, 0.9) == pytest.approx((np.pi / 2, 0.9))
    assert watch.to_try(ahead, FACING, 0.9) is None and watch.to_try(0.3 * ahead, FACING, 0.4) is None
    sides = [watch.to_try(ahead, FACING, 0.4) for _ in range(3)]
    assert [np.degrees(side[0]) for side in sides] == pytest.approx([-45.0, 45.0, -45.0])
    assert sides[0][1] < 1.0


def test_glances_are_more_frequent_than_tests_and_only_where_a_side_was_seen():
    sideways = Pose(
        FACING.root, np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]), FACING.angles
    )
    for pose, most in ((sideways, 300), (FACING, 40)):
        watch, glances = FacingWatch(), 0
        for _ in range(600):
            watch.looks()
            watch.due(pose, AHEAD, None)
            glances += watch.glances
        assert glances <= most and (pose is FACING or glances == 300)


SMALL = replace(TUNING[3], name="small", height_m=0.9, head=1.45, legs=0.88, arms=0.92, seed=77)


def test_a_small_child_is_turned_by_where_its_head_faces():
    cameras, placed, sets, _ = simulated(arms_crossed(), performer=SMALL, end_s=1.0)
    tracker = Tracker(cameras, placed)
    for images in sets[:10]:
        tracker.track(images)
    turned = turned_round(
        tracker.bodies[0].fitter,
        tracker.bodies[0].figure,
        tracker.bodies[0].motion.pose,
        tracker.bodies[0].motion.posture,
    )
    tracker.bodies[0].motion.restart(turned)
    for images in sets[10:22]:
        tracker.track(images)
    assert abs(heading(tracker.bodies[0].motion.pose)) < 0.5


def test_no_image_no_face():
    cameras, placed, sets, _ = simulated(arms_crossed(), end_s=0.1)
    (name,) = cameras
    view = CameraView(cameras[name], placed[name])
    head = np.array([0.0, 0.0, 1.6])
    assert (Heads({name: view}, {}).face(head) == 0).all()
    face = Heads({name: view}, sets[0]).face(head)
    towards = placed[name][:2, 3] / np.linalg.norm(placed[name][:2, 3])
    assert np.hypot(*face) > 0.7 and face @ towards > 0.7  # the performer looks into the camera
    assert (Heads({name: view}, sets[0]).face(head + np.append(0.6 * towards, 0.0)) == 0).all()
