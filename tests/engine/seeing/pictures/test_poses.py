"""Poses from pictures, found by the real models on real videos."""

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from studio.engine.base.errors import FormatError, NotAvailableError, SettingsError
from studio.engine.model.joints import JOINT_SETS
from studio.engine.seeing.pictures.people import PeopleDetector, Person
from studio.engine.seeing.pictures.poses import PoseFinder, nearest
from studio.engine.seeing.pictures.region import Region
from tests.engine.seeing.pictures.videos import pictures_of, reprojected, true_cameras
from tests.refused import refused

LIMBS = slice(11, 29)
"""Shoulders to ankles."""


@pytest.fixture(scope="module")
def single(test_data) -> Path:
    return test_data / "rgb" / "pose2sim_single"


@pytest.fixture(scope="module")
def picture(single):
    return pictures_of(single / "cam04.mp4", count=1)[0]


@pytest.fixture(scope="module")
def pose(picture):
    return PoseFinder("full").find(picture)


@pytest.mark.parametrize(("model", "most_px"), [("full", 8.0), ("lite", 10.0)])
def test_landmarks_meet_where_the_true_cameras_see_them(single, model, most_px):
    """Four cameras around a person on a treadmill, in a tenth of the frames."""
    cameras = true_cameras(single)
    pixels = []
    for name in cameras:
        finder = PoseFinder(model)
        found = [finder.find(picture) for picture in pictures_of(single / f"{name}.mp4", every=10)]
        assert all(one is not None and one.people == 1 for one in found)
        pixels.append(np.concatenate([one.pixels for one in found]))
    errors = reprojected(np.array(pixels), list(cameras.values()))
    assert np.median(errors) < most_px


def test_a_pose_has_the_shapes_and_sense_that_it_says(picture, pose):
    count = len(JOINT_SETS["mediapipe"])
    assert pose.pixels.shape == (count, 2) and pose.world_m.shape == (count, 3)
    assert pose.visibility.shape == pose.presence.shape == (count,)
    assert 0 <= pose.visibility.min() and pose.visibility.max() <= 1
    nose, ankles = 0, [27, 28]
    assert (pose.pixels[nose, 1] < pose.pixels[ankles, 1]).all()
    assert (pose.world_m[nose, 1] < pose.world_m[ankles, 1]).all()
    assert 1.2 < np.ptp(pose.world_m[:, 1]) < 2.2
    assert np.abs(pose.world_m[[23, 24]].mean(axis=0)).max() < 0.05


@pytest.mark.parametrize("turns", [1, 2, 3])
def test_a_turned_picture_gives_the_turned_pose(picture, pose, turns):
    """A phone that is held on its side."""
    turned = PoseFinder("full").find(np.rot90(picture, turns))
    assert turned is not None
    height, width = picture.shape[:2]
    down, across = (width, height) if turns % 2 else (height, width)
    pixels, metres = turned.pixels, turned.world_m
    for _ in range(turns):  # back, clockwise
        pixels = np.stack([down - 1 - pixels[:, 1], pixels[:, 0]], axis=1)
        metres = np.stack([-metres[:, 1], metres[:, 0], metres[:, 2]], axis=1)
        down, across = across, down
    assert np.median(np.linalg.norm(pixels - pose.pixels, axis=1)[LIMBS]) < 20
    assert np.median(np.linalg.norm((metres - pose.world_m)[LIMBS, :2], axis=1)) < 0.06


def test_a_small_picture_gives_the_same_pose(picture, pose):
    small = PoseFinder("full").find(np.asarray(Image.fromarray(picture).reduce(3)))
    assert small is not None
    apart = np.linalg.norm(3 * (small.pixels + 0.5) - 0.5 - pose.pixels, axis=1)
    assert np.median(apart[LIMBS]) < 8


def test_a_person_who_leaves_is_lost_and_found_again(picture, pose):
    finder = PoseFinder("lite")
    assert finder.find(picture) is not None
    black = np.zeros_like(picture)
    assert finder.find(black) is None and finder.find(black) is None
    again = finder.find(np.ascontiguousarray(picture[:, ::-1]))  # at another place now
    assert again is not None
    assert abs(again.pixels[LIMBS, 0].mean() - (picture.shape[1] - 1 - pose.pixels[LIMBS, 0].mean())) < 20


def test_two_people_are_counted_and_one_is_followed(test_data):
    pictures = pictures_of(test_data / "rgb" / "pose2sim_two" / "cam01.mp4", every=10)
    finder = PoseFinder("lite")
    found = [finder.find(picture) for picture in pictures]
    assert all(one is not None for one in found) and found[0].people == 2
    middles = np.array([one.pixels[LIMBS].mean(axis=0) for one in found])
    assert np.linalg.norm(np.diff(middles, axis=0), axis=1).max() < 300


def test_of_people_alike_in_size_the_one_in_the_middle_is_taken():
    people = [
        Person(Region(100, 300, 400), 0.9),
        Person(Region(520, 300, 300), 0.8),
        Person(Region(500, 300, 80), 0.7),
    ]
    assert nearest(people, 1000, 600) is people[1]
    assert nearest([people[0], people[2]], 1000, 600) is people[0]


@pytest.mark.parametrize(
    "picture",
    [
        np.zeros((10, 10), np.uint8),
        np.zeros((10, 10, 4), np.uint8),
        np.zeros((10, 10, 3)),
        np.zeros((0, 5, 3), np.uint8),
    ],
)
def test_what_is_no_picture_is_refused(picture):
    with refused(SettingsError, "value.bad"):
        PoseFinder("lite").find(picture)


@pytest.mark.parametrize("size", [(1, 1), (3, 4000), (4000, 3)])
def test_pictures_of_odd_sizes_show_nobody(size):
    assert PoseFinder("lite").find(np.full((*size, 3), 128, np.uint8)) is None


def test_models_that_are_none_are_said(tmp_path):
    from studio.engine.seeing.pictures.bundle import MODELS

    cut = tmp_path / "cut.task"
    cut.write_bytes((MODELS / "pose_landmarker_lite.task").read_bytes()[:100_000])
    text = tmp_path / "text.task"
    text.write_text("no model", encoding="utf-8")
    for path in (cut, text, MODELS / "hand_landmarker.task"):
        with refused(FormatError, "model.broken"):
            PoseFinder(path)
    with refused(SettingsError, "value.unknown"):
        PoseFinder("missing.task")
    with refused(NotAvailableError, "model.no_heavy"):
        PoseFinder("heavy")


def test_a_network_that_is_none_is_said(tmp_path):
    with refused(FormatError, "model.broken"):
        PeopleDetector(b"no network", tmp_path / "one.task")
