"""Two people in front of depth cameras: each explains their own points."""

import numpy as np
import pytest

from studio.engine.model.calibration import Calibration, CameraCalibration
from studio.engine.seeing.observer import Observer
from studio.engine.seeing.tracker.skeletons import from_points, per_camera
from studio.engine.seeing.tracker.tracker import Tracker
from tests.engine.seeing.tracker.couples import couple, goes, stays
from tests.engine.seeing.tracker.scenes import LIMBS


@pytest.fixture(scope="module")
def touching():
    """Two people in a T-pose in front of one camera, hand on hand."""
    return couple(stays(-0.75), stays(0.75), seconds=0.4)


def errors(skeletons, truth):
    """Mean error of the limbs [m] by body and person, shape (2, 2), over the instants that show both."""
    out = np.full((len(skeletons), 2, 2), np.nan)
    for k, skeleton in enumerate(skeletons):
        for one in skeleton.each():
            if one.status == "tracked" and one.body < 2:
                off = np.linalg.norm(one.positions - truth[:, k], axis=2)
                out[k, one.body] = off[:, LIMBS].mean(axis=1)
    return out


def pairing(off):
    """The person that body 0 tracks."""
    return int(np.nanmean(off[:, 0, 1]) < np.nanmean(off[:, 0, 0]))


def test_people_whose_arms_touch_are_two_from_the_first_image(touching):
    cameras, placed, sets, truth = touching
    tracker = Tracker(cameras, placed)
    skeletons = [tracker.track(images) for images in sets]
    assert [len(one.each()) for one in skeletons] == [2] * len(sets)
    off = errors(skeletons, truth)
    who = pairing(off)
    assert off[2:, 0, who].mean() < 0.06 and off[2:, 1, 1 - who].mean() < 0.06


def test_frames_hold_every_body(touching):
    cameras, placed, sets, _ = touching
    calibration = Calibration("x", {name: CameraCalibration(T) for name, T in placed.items()})
    images = [image for s in sets[:2] for image in s.values()]
    (name,) = placed
    points, _ = list(from_points(images, cameras, calibration))[-1]
    own = list(per_camera(images, cameras))[-1]
    for frame in (points, own):
        bodies = frame.bodies()
        assert [body.body for body in bodies] == [0, 1] and bodies[1].device_time_ns == frame.device_time_ns
    apart_m = [np.linalg.norm(a.positions[0] - b.positions[0]) for a, b in (points.bodies(), own.bodies())]
    assert abs(apart_m[0] - apart_m[1]) < 0.05 and 1.3 < apart_m[0] < 1.7
    (camera,) = cameras.values()
    observer = Observer(name, camera)
    seen = [observer.observe(image.device_time_ns, image.depth_mm) for image in images][-1]
    assert [one.body for one in (seen, *seen.others)] == [0, 1] and seen.others[0].hands


def test_one_goes_behind_the_other():
    cameras, placed, sets, truth = couple(
        stays(0.0, -0.3), goes((-0.9, 0.5), (0.9, 0.5), 0.9, 1.2), seconds=2.2, begin_s=4.0
    )
    tracker = Tracker(cameras, placed)
    off = errors([tracker.track(images) for images in sets], truth)
    begun = int(np.flatnonzero(np.isfinite(off[:, 1, 1]))[0])
    assert begun < 13 and off[:, 0, 0].max() < 0.12  # the person in front keeps their identity
    seen = np.isfinite(off[begun:, 1, 1])
    assert seen.mean() > 0.6 and seen[-4:].all() and off[-4:, 1, 1].max() < 0.2
    assert np.nanmin(off[begun:, 1, 0]) > 0.25  # nor did the other take their body


def test_who_comes_in_is_followed_and_changes_nothing_of_the_other_before():
    cameras, placed, sets, truth = couple(stays(-0.8), stays(0.8), seconds=1.6, enters_s=0.4)
    tracker = Tracker(cameras, placed)
    skeletons = [tracker.track(images) for images in sets]
    counts = [len(one.each()) for one in skeletons]
    assert counts[:6] == [1] * 6 and counts[-1] == 2 == max(counts)
    off = errors(skeletons, truth)
    assert off[-1, 0, 0] < 0.06 and off[-1, 1, 1] < 0.06
    alone, _, same, _ = couple(stays(-0.8), stays(0.8), seconds=0.4, enters_s=9.0)
    single = Tracker(alone, placed)
    for images, skeleton in zip(same, skeletons, strict=False):
        np.testing.assert_array_equal(single.track(images).positions, skeleton.positions)


def test_who_leaves_ends_and_the_other_goes_on(touching):
    cameras, placed, sets, _ = touching
    tracker = Tracker(cameras, placed)
    for images in sets[:3]:
        tracker.track(images)
    gone = tracker.bodies[0].placed[1].root[0]
    others = []
    for k in range(8):
        images = {}
        for name, frame in sets[2].items():
            depth = frame.depth_mm.copy()
            half = depth.shape[1] // 2
            side = slice(None, half) if gone < 0 else slice(half, None)
            depth[:, side] = 0
            time_ns = frame.device_time_ns + (k + 1) * 66_666_667
            images[name] = type(frame)(name, frame.sequence + k + 1, time_ns, depth)
        others.append([one.body for one in tracker.track(images).each()])
    assert others[-1] == [1]
