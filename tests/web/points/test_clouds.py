"""The thread that makes clouds: of a real take at its playhead, of the live stage; what is missing is told."""

import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial import cKDTree

from studio.engine.model.frames import StepResult
from studio.engine.model.joints import INDEX
from studio.live.cameras.newest_depth import ArrivedDepth, NewestDepth
from studio.take.folder.take import Take
from studio.web.playback.clip import Clip
from studio.web.playback.raw_clip import load_raw
from studio.web.points.clouds import PointClouds
from studio.web.points.colours import NOBODY_RGB
from studio.web.points.live import FRESH_S, LiveDepth
from studio.web.points.maker import BUDGET_BYTES_S, RATE_HZ
from studio.web.points.replayed import NO_DEPTH, ReplayedDepth
from studio.web.scene.clouds import ORIGIN_M
from studio.web.scene.palette import confidence_colours
from tests.web.points.depth_takes import (
    CAMERAS,
    DAMAGED,
    GAP,
    calibration,
    images,
    joints,
    stage,
    take_with_depth,
)
from tests.web.stages import until


class Clouds(PointClouds):
    """Clouds that somebody looks at, and how many there have been."""

    def __init__(self, newest: NewestDepth, clock=time.monotonic) -> None:
        self.made = 0
        self.bytes = 0
        super().__init__(LiveDepth(newest, calibration, clock), watched=lambda: True, changed=self._count)
        self.choose(shown=True)

    def _count(self) -> None:
        self.made += 1
        for cloud in self.newest.values():
            self.bytes += cloud.points.nbytes + (0 if cloud.colours is None else cloud.colours.nbytes)

    def says(self, camera: str) -> str:
        return self.status().says.get(camera, "")


@pytest.fixture
def live() -> NewestDepth:
    return NewestDepth()


@pytest.fixture
def clouds(live: NewestDepth, ready_worker: None) -> Iterator[Clouds]:
    made = Clouds(live)
    yield made
    made.close()


@pytest.fixture(scope="module")
def take(tmp_path_factory: pytest.TempPathFactory) -> Take:
    return take_with_depth(tmp_path_factory.mktemp("s") / "monday" / "still")


@pytest.fixture(scope="module")
def clip(take: Take) -> Clip:
    return Clip.load(take, "studio")


def show(clouds: Clouds, clip: Clip, frame: int) -> StepResult:
    clouds.show(clip.depth, step := clip.step(frame))
    return step


def seen(clouds: Clouds, *names: str) -> bool:
    return set(clouds.newest) == set(names) and not clouds.status().problem


def on_stage(clouds: Clouds, name: str) -> np.ndarray:
    return clouds.newest[name].points.astype(float) + ORIGIN_M


def test_a_take_shows_what_each_camera_saw_at_the_playhead(clouds, clip):
    show(clouds, clip, 2)
    until(lambda: seen(clouds, *CAMERAS))
    first, second = (on_stage(clouds, name) for name in CAMERAS)
    assert len(first) == len(second) == int(BUDGET_BYTES_S / RATE_HZ / 6 / 2)
    for points in (first, second):
        assert cKDTree(points).query(joints())[0].max() < 0.25
    assert np.median(cKDTree(first).query(second)[0]) > 0.01, "two cameras see two sides"
    show(clouds, clip, GAP[3])
    until(lambda: seen(clouds, CAMERAS[0]))
    assert clouds.says(CAMERAS[1]) == "no_image"
    show(clouds, clip, DAMAGED)
    until(lambda: clouds.says(CAMERAS[1]) == "damaged")
    assert seen(clouds, CAMERAS[0])
    show(clouds, clip, 20)
    until(lambda: seen(clouds, *CAMERAS))
    assert clouds.says(CAMERAS[1]) == ""


def test_cameras_are_switched_one_by_one(clouds, clip):
    show(clouds, clip, 2)
    until(lambda: seen(clouds, *CAMERAS))
    clouds.choose(cameras={CAMERAS[0]: False})
    until(lambda: seen(clouds, CAMERAS[1]))
    assert clouds.status().cameras == {CAMERAS[0]: False, CAMERAS[1]: True}
    assert len(clouds.newest[CAMERAS[1]].points) == int(BUDGET_BYTES_S / RATE_HZ / 6), (
        "it has all of the budget"
    )
    clouds.choose(cameras={CAMERAS[0]: True})
    until(lambda: seen(clouds, *CAMERAS))
    clouds.choose(shown=False)
    until(lambda: not clouds.newest)
    assert clouds.status().cameras == {}


def test_points_have_the_colour_of_the_confidence_of_the_nearest_joint(clouds, clip):
    clouds.choose(colour="confidence")
    show(clouds, clip, 2)
    until(lambda: seen(clouds, *CAMERAS))
    points, colours = on_stage(clouds, CAMERAS[0]), clouds.newest[CAMERAS[0]].colours
    assert colours is not None and len(points) == int(BUDGET_BYTES_S / RATE_HZ / 9 / 2)
    sure, unsure = confidence_colours(np.array([1.0, 0.0]))
    tree = cKDTree(points)

    def near(joint: str) -> np.ndarray:
        return colours[tree.query_ball_point(joints()[INDEX[joint]], 0.15)]

    for joint, wanted in (("right_elbow", sure), ("head", sure), ("left_knee", sure), ("left_elbow", unsure)):
        assert len(near(joint)) > 10 and (near(joint) == wanted).all(axis=1).mean() > 0.9, joint
    far = np.linalg.norm(points[:, :2] - joints()[0, :2], axis=1) > 1.2
    assert far.sum() > 100 and (colours[far] == NOBODY_RGB).all()


def test_a_take_without_a_solve_shows_points_without_confidence(clouds, take):
    raw = load_raw(take)
    show(clouds, raw, 2)
    until(lambda: seen(clouds, *CAMERAS))
    assert cKDTree(on_stage(clouds, CAMERAS[0])).query(joints())[0].max() < 0.3
    clouds.choose(colour="confidence")
    until(lambda: seen(clouds, *CAMERAS) and clouds.newest[CAMERAS[0]].colours is not None)
    assert (clouds.newest[CAMERAS[0]].colours == NOBODY_RGB).all()


def test_cameras_without_a_place_say_so_and_side_by_side_they_have_one(clouds, take, tmp_path):
    clouds.show(ReplayedDepth(take.raw_path), Clip.load(take, "studio").step(2))
    until(lambda: clouds.says(CAMERAS[0]) == "no_place")
    assert not clouds.newest
    nowhere = take_with_depth(tmp_path / "monday" / "nowhere", calibrated=False, solved=False)
    show(clouds, load_raw(nowhere), 2)
    until(lambda: seen(clouds, *CAMERAS))
    middles = [np.median(on_stage(clouds, name), axis=0) for name in CAMERAS]
    assert middles[1][0] - middles[0][0] > 1.0


def test_a_take_without_depth_and_one_that_is_broken_say_so(clouds, clip, tmp_path: Path):
    clouds.show(NO_DEPTH, clip.step(0))
    until(lambda: not clouds.status().problem)
    assert clouds.status().cameras == {} and not clouds.newest
    broken = tmp_path / "raw.mcap"
    broken.write_bytes(b"nothing of the kind")
    clouds.show(ReplayedDepth(broken), clip.step(0))
    until(lambda: clouds.status().problem == "unreadable")
    assert clouds.status().cameras == {} and not clouds.newest


def test_live_depth_is_shown_while_it_is_fresh(live):
    now = [10.0]
    clouds = Clouds(live, clock=lambda: now[0])
    try:
        camera = stage().sensor.camera
        live.put(CAMERAS[0], ArrivedDepth(camera, images()[0], round(9.9e9), whole=True))
        live.put("stranger", ArrivedDepth(camera, images()[0], round(9.9e9), whole=True))
        until(lambda: seen(clouds, CAMERAS[0]))
        assert clouds.says("stranger") == "no_place"
        assert np.percentile(np.abs(on_stage(clouds, CAMERAS[0])[:, 2]), 5) < 0.002, "the floor is seen"
        now[0] += FRESH_S
        until(lambda: not clouds.newest)
        assert clouds.says(CAMERAS[0]) == "no_image"
    finally:
        clouds.close()


def test_no_browser_gets_more_than_the_budget(clouds, clip):
    """At any speed of the playhead, counted over a second and a half."""
    show(clouds, clip, 0)
    until(lambda: seen(clouds, *CAMERAS))
    begun_s, made, size = time.monotonic(), clouds.made, clouds.bytes
    frame = 0
    while time.monotonic() - begun_s < 1.5:
        frame = (frame + 1) % 7
        show(clouds, clip, frame)
    clouds.close()
    passed_s = time.monotonic() - begun_s
    assert 1 < clouds.made - made <= RATE_HZ * passed_s + 1
    assert clouds.bytes - size <= BUDGET_BYTES_S * (passed_s + 1 / RATE_HZ)
