"""Solved heads that follow simulated glances: the bar of the head's orientation."""

from collections.abc import Callable
from functools import cache

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from studio.engine.animation.motion.authored import stage_motion
from studio.engine.model.joints import INDEX
from studio.simulator.landmarks.body import PLACES, landmarks_of
from studio.simulator.landmarks.heads import FACE, FaceErrors, SimulatedHead, hidden_by_skull
from tests.simulator.finger_figures import SeenStage, seen_stage
from tests.simulator.head_figures import ANYBODY_DEG, BAR_DEG, figures, rig


@pytest.fixture(scope="module", params=[2, pytest.param(3, marks=pytest.mark.long)])
def stage(request: pytest.FixtureRequest) -> SeenStage:
    return seen_stage(7.0, 13, rig(request.param))


@pytest.fixture(scope="module")
def errors(stage: SeenStage) -> Callable[[str], NDArray[np.float64]]:
    """The errors of the stage's solve with a preset, each computed once."""
    return cache(lambda preset: figures(stage, preset)[:, 0])


def test_heads_glance_about_and_come_back() -> None:
    motion = stage_motion()
    head = SimulatedHead(3)
    times = np.arange(4.0, 60.0, 0.1)
    turns = np.array([head.straight(motion.at(t)).T @ head.rotation(motion.at(t), t) for t in times.tolist()])
    angles = np.degrees(Rotation.from_matrix(turns).magnitude())
    assert 20.0 < angles.max() < 60.0 and np.median(angles) < 25.0 and angles.min() < 1.0
    assert np.array_equal(head.rotation(motion.at(5.5), 5.5), SimulatedHead(3).rotation(motion.at(5.5), 5.5))
    assert (head.seen_size < 1.2).all() and (head.seen_size > 0.4).all()


def test_a_turned_head_turns_its_face_about_the_ears() -> None:
    motion = stage_motion()
    joints, anatomy = motion.at(5.0)[None], np.zeros((33, 3))
    turned = Rotation.from_euler("z", 0.5).as_matrix()
    ahead, aside = (
        landmarks_of(joints, motion.offsets_m, anatomy, head[None])[0] for head in (np.eye(3), turned)
    )
    place = joints[0, INDEX["head"]]
    assert np.allclose(aside[FACE] - place, (ahead[FACE] - place) @ turned.T)
    assert np.array_equal(aside[FACE.stop :], ahead[FACE.stop :])


def test_the_skull_hides_the_face_from_behind_and_an_ear_from_its_other_side() -> None:
    behind = hidden_by_skull(PLACES[FACE], np.eye(3), np.array([0.0, 2.0, 0.0]))
    left = hidden_by_skull(PLACES[FACE], np.eye(3), np.array([2.0, 0.0, 0.0]))
    assert behind.sum() == 9 and not behind[7:9].any()
    assert left[8] and not left[[0, 7]].any()


def test_faces_err_for_a_while() -> None:
    errors = FaceErrors(seed=1, camera=0)
    course = np.array([errors.next_m() for _ in range(3000)])
    assert 0.009 < course.std() < 0.02
    assert np.corrcoef(course[:-30, 0], course[30:, 0])[0, 1] > 0.1


@pytest.mark.parametrize("preset", ["studio", "finish"])
def test_heads_follow_what_ordinary_cameras_see(
    errors: Callable[[str], NDArray[np.float64]], preset: str
) -> None:
    assert np.median(errors(preset)) < ANYBODY_DEG


@pytest.mark.parametrize("preset", ["studio", pytest.param("finish", marks=pytest.mark.long)])
def test_glances_are_nearer_than_a_head_that_looks_ahead(
    stage: SeenStage, errors: Callable[[str], NDArray[np.float64]], preset: str
) -> None:
    ahead = figures(stage, preset, ["look_at=far"])[:, 0]
    assert np.percentile(errors(preset), 90) < 0.75 * np.percentile(ahead, 90)


@pytest.mark.long
@pytest.mark.parametrize("preset", ["studio", "finish"])
@pytest.mark.parametrize("cameras", [2, 3])
def test_other_heads_are_followed_too(cameras: int, preset: str) -> None:
    errors = [figures(seen_stage(30.0, seed, rig(cameras)), preset)[:, 0] for seed in range(21, 27)]
    assert np.median(np.concatenate(errors)) < BAR_DEG
