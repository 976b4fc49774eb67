"""Processing images in parallel and ahead of time gives the same skeletons, to the last bit, as one by one."""

from dataclasses import replace

import numpy as np
import pytest

from studio.engine.animation.motion.torture import arms_crossed
from studio.engine.base.errors import FormatError
from studio.engine.model.cameras.depth import DepthFrame
from studio.engine.seeing.tracker import looking
from studio.engine.seeing.tracker.skeletons import with_next
from studio.engine.seeing.tracker.tracker import Tracker
from tests.engine.seeing.tracker.scenes import simulated


@pytest.fixture(scope="module")
def scene():
    """A person in front of three cameras, who is gone for a while and comes back."""
    cameras, placed, sets, _ = simulated(arms_crossed(), cameras=3, end_s=0.25)
    last = sets[-1]

    def later(images, k, depth_mm=None):
        time_ns = next(iter(last.values())).device_time_ns + (k + 1) * 33_333_333
        return {
            name: replace(
                image, device_time_ns=time_ns, depth_mm=image.depth_mm if depth_mm is None else depth_mm
            )
            for name, image in images.items()
        }

    empty = np.zeros(next(iter(last.values())).depth_mm.shape, np.uint16)
    gone = [later(last, k, empty) for k in range(12)]
    back = [later(images, 12 + k) for k, images in enumerate(sets[:2])]
    return cameras, placed, [*sets, *gone, *back]


def tracked(scene, monkeypatch, cores: int, *, ahead: bool):
    cameras, placed, sets = scene
    monkeypatch.setattr(looking, "core_count", lambda: cores)
    tracker = Tracker(cameras, placed)
    return [tracker.track(images, following if ahead else None) for images, following in with_next(sets)]


def test_the_skeletons_are_the_same_on_any_number_of_cores(scene, monkeypatch):
    one = tracked(scene, monkeypatch, 1, ahead=False)
    assert [skeleton.status for skeleton in one].count("lost") > 3 and one[-1].status == "tracked"
    for cores, ahead in ((1, True), (2, False), (3, True)):
        for a, b in zip(one, tracked(scene, monkeypatch, cores, ahead=ahead), strict=True):
            assert np.array_equal(a.positions, b.positions, equal_nan=True)
            assert np.array_equal(a.confidence, b.confidence) and a.status == b.status


def test_other_images_than_were_told_of_are_looked_at(scene, monkeypatch):
    cameras, placed, sets = scene
    one = tracked((cameras, placed, sets[:4]), monkeypatch, 1, ahead=False)
    monkeypatch.setattr(looking, "core_count", lambda: 3)
    tracker = Tracker(cameras, placed)
    for images, skeleton in zip(sets[:4], one, strict=True):
        found = tracker.track(images, sets[7])
        assert np.array_equal(found.positions, skeleton.positions)


def test_an_image_of_another_size_is_told_when_its_turn_comes(scene, monkeypatch):
    cameras, placed, sets = scene
    monkeypatch.setattr(looking, "core_count", lambda: 3)
    tracker = Tracker(cameras, placed)
    other = {name: DepthFrame(name, 99, 0, np.zeros((4, 5), np.uint16)) for name in sets[0]}
    assert tracker.track(sets[0], other).status == "tracked"
    with pytest.raises(FormatError, match="5 x 4 pixels"):
        tracker.track(other)


def test_sets_come_with_the_next_ones():
    sets = [{"a": DepthFrame("a", k, k, np.zeros((1, 1), np.uint16))} for k in range(3)]
    assert list(with_next(sets)) == [(sets[0], sets[1]), (sets[1], sets[2]), (sets[2], None)]
    assert list(with_next([])) == []
