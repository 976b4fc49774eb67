"""Hands in pictures, found by the real model on real videos."""

from pathlib import Path

import numpy as np
import pytest

from studio.engine.model.joints import JOINT_SETS
from studio.engine.seeing.pictures.hands import HAND_LANDMARKS, HandFinder, followed, hand_length, square_of
from studio.engine.seeing.pictures.poses import PoseFinder
from tests.engine.seeing.pictures.videos import pictures_of

NAMES = JOINT_SETS["mediapipe"]
TIPS = [4, 8, 12, 16, 20]


def arm(pose, side):
    return pose.pixels[[NAMES.index(f"{side}_{part}") for part in ("elbow", "wrist", "pinky", "index")]]


@pytest.fixture(scope="module")
def seen(test_data: Path):
    """Pictures of a person on a treadmill whose left hand is in sight, with their poses."""
    pictures = pictures_of(test_data / "rgb" / "pose2sim_single" / "cam04.mp4", count=20)
    finder = PoseFinder("full")
    return [(picture, finder.find(picture)) for picture in pictures]


def test_a_hand_in_sight_is_found_at_the_end_of_its_arm(seen):
    finder, found = HandFinder(), 0
    for picture, pose in seen:
        left, _ = finder.find(picture, pose.pixels, pose.visibility)
        if left is None:
            continue
        found += 1
        elbow, wrist, *_ = arm(pose, "left")
        length = hand_length(arm(pose, "left"))
        assert left.shape == (HAND_LANDMARKS, 2)
        assert np.hypot(*(left[0] - wrist)) < 0.5 * length
        reach = (left[TIPS] - wrist) @ (wrist - elbow) / np.hypot(*(wrist - elbow))
        assert (reach > 0.0).all() and reach.max() < 1.5 * length
    assert found >= 0.7 * len(seen)


def test_nothing_is_found_where_no_hand_is(seen):
    picture, pose = seen[0]
    finder = HandFinder()
    assert finder.find(np.zeros_like(picture), pose.pixels, pose.visibility) == [None, None]
    assert finder.find(picture, pose.pixels, np.zeros(len(NAMES))) == [None, None]
    outside = pose.pixels + np.array([3.0 * picture.shape[1], 0.0])
    assert finder.find(picture, outside, pose.visibility) == [None, None]


def test_hands_that_are_too_small_are_not_looked_for(seen):
    picture, pose = seen[0]
    small = HandFinder().find(picture, pose.pixels, pose.visibility, reduced=0.1)
    assert small == [None, None]
    large = [HandFinder().find(picture, pose.pixels, pose.visibility)[0] for picture, pose in seen[:5]]
    assert any(hand is not None for hand in large)


def test_a_square_is_about_the_hand_with_its_fingers_upwards():
    straight = np.array([[100.0, 300.0], [100.0, 200.0], [90.0, 160.0], [110.0, 160.0]])
    square = square_of(straight)
    assert (square.x, square.angle) == pytest.approx((100.0, 0.0)) and square.y < 160.0
    assert square.side == pytest.approx(2.2 * hand_length(straight))
    points = np.column_stack([np.linspace(40.0, 120.0, HAND_LANDMARKS), np.full(HAND_LANDMARKS, 50.0)])
    after = followed(points)
    assert after.angle == pytest.approx(np.pi / 2) and after.x > 80.0 and after.y == pytest.approx(50.0)
    assert after.side == pytest.approx(160.0)
