"""A walk in front of ordinary cameras, solved live and finished: the joints against the truth."""

from collections.abc import Callable
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from studio.engine.calibration.quality.watch import CameraWatch
from studio.engine.model.frames import StepResult
from tests.engine.whole_take.walking import PicturedWalk, read_treadmill, read_walk

Solves = Callable[[tuple[str, ...]], list[list[StepResult]]]


@pytest.fixture(
    scope="module", params=[60, pytest.param(None, marks=pytest.mark.long)], ids=["second", "whole"]
)
def treadmill(request: pytest.FixtureRequest, test_data: Path) -> PicturedWalk:
    """A second of the videos at 60 Hz, or all of them."""
    folder = test_data / "rgb" / "pose2sim_single"
    if not folder.is_dir():
        pytest.skip(f"no {folder}")
    return read_treadmill(folder, request.param)


@pytest.fixture(scope="module")
def walk(test_data: Path) -> PicturedWalk:
    folder = test_data / "rgb" / "walk_4_cameras"
    if not folder.is_dir():
        pytest.skip(f"no {folder}")
    return read_walk(folder)


@pytest.fixture(scope="module")
def as_seen(walk: PicturedWalk) -> Solves:
    """The live solves of the walk by some of the cameras, each computed once."""
    return cache(walk.solved)


@pytest.mark.parametrize(
    ("names", "live_mm", "finished_mm"),
    [
        (("cam01", "cam02", "cam03", "cam04"), 25.0, 22.0),
        (("cam01", "cam02"), 35.0, 32.0),
        pytest.param(("cam02", "cam04"), 40.0, 36.0, marks=pytest.mark.long),
    ],
    ids=["four", "two", "two others"],
)
def test_a_walk_is_solved_from_rays(
    walk: PicturedWalk, as_seen: Solves, names: tuple[str, ...], live_mm: float, finished_mm: float
) -> None:
    live = as_seen(names)
    assert walk.errors_mm(live).mean() < live_mm
    errors = walk.errors_mm(walk.finished(live))
    assert errors.mean() < finished_mm and np.percentile(errors, 95) < 2.6 * finished_mm


def test_a_performer_walks_on_where_all_cameras_but_one_lose_him(walk: PicturedWalk) -> None:
    left = walk.with_one_left("cam01", 0.8)
    finished = left.finished(left.solved(tuple(walk.cameras)))
    error_mm = left.errors_mm(finished, left.last(0.8)).mean()
    assert error_mm < 59.0  # 62 with hips that accelerate twice as easily


@pytest.mark.parametrize(
    ("names", "live_mm"),
    [
        (("cam01", "cam02", "cam03", "cam04"), 25.0),
        (("cam01", "cam04"), 50.0),
        pytest.param(("cam02", "cam04"), 50.0, marks=pytest.mark.long),
    ],
    ids=["four", "two", "two others"],
)
def test_videos_of_a_treadmill_are_solved_live(
    treadmill: PicturedWalk, names: tuple[str, ...], live_mm: float
) -> None:
    live = treadmill.solved(names)
    assert treadmill.errors_mm(live).mean() < live_mm
    finished = treadmill.finished(live)
    assert treadmill.errors_mm(finished).mean() < 0.95 * live_mm
    assert (
        treadmill.jerk_m_s3(finished) < 500.0
    )  # 600 to 720 if each frame of 60 a second counts as one of 30


@pytest.mark.parametrize(
    "other", ["cam02", *(pytest.param(name, marks=pytest.mark.long) for name in ("cam03", "cam04"))]
)
def test_a_solve_starts_with_left_and_right_as_they_are(
    walk: PicturedWalk, as_seen: Solves, other: str
) -> None:
    """One or both cameras exchange them in the first frames of each place."""
    names = ("cam01", other)
    usual_mm = walk.errors_mm(as_seen(names)).mean()
    turned = walk.with_exchanged_at_first(other, frames=6)
    assert turned.errors_mm(turned.solved(names)).mean() < 1.1 * usual_mm
    both = turned.with_exchanged_at_first("cam01", frames=6)
    assert both.errors_mm(both.solved(names)).mean() < 1.1 * usual_mm


@pytest.mark.parametrize("turned", [None, "cam02"], ids=["none", "one"])
def test_a_camera_that_was_turned_is_named(walk: PicturedWalk, as_seen: Solves, turned: str | None) -> None:
    watch, moved = CameraWatch(), set[str]()
    solves = as_seen if turned is None else walk.with_turned(turned, 3.0).solved
    for segment in solves(("cam01", "cam02", "cam03")):
        for result in segment:
            watch.add(result.frame_set)
            moved |= watch.moved().keys()
    assert moved == (set() if turned is None else {turned})


def test_a_camera_that_exchanges_left_and_right_is_found_out(walk: PicturedWalk, as_seen: Solves) -> None:
    names = ("cam01", "cam02", "cam03")
    usual_mm = walk.errors_mm(as_seen(names)).mean()
    turned = walk.with_exchanged("cam02", every=5)
    assert turned.errors_mm(turned.solved(names)).mean() < 1.15 * usual_mm
