"""The looks from which all of the stage, of a motion or of a performer is seen: as the page itself works them out."""

import itertools
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from playwright.sync_api import Page

from studio.web.playback.space import space_of

pytestmark = pytest.mark.browser
FOV_RAD = np.radians(37.0)

Works = Callable[..., Any]


@pytest.fixture
def works(address: str, page: Page) -> Works:
    """Calls a function of the page's module."""
    page.goto(f"{address}/camera")

    def call(name: str, *arguments: Any) -> Any:
        code = "async ([name, args]) => (await import('/static/view/framing.js'))[name](...args)"
        return page.evaluate(
            code, [name, [a.tolist() if isinstance(a, np.ndarray) else a for a in arguments]]
        )

    return call


def in_picture(points: NDArray[np.float64], look: dict[str, Any], aspect: float) -> NDArray[np.float64]:
    """Places in the picture, -1 to 1 in both directions, shape (N, 2)."""
    position, target = np.array(look["position"]), np.array(look["target"])
    forward = (target - position) / np.linalg.norm(target - position)
    right = np.cross(forward, [0.0, 0.0, 1.0])
    right /= np.linalg.norm(right)
    places = (points - position) @ np.stack([right, np.cross(right, forward), forward]).T
    assert (places[:, 2] > 0).all()
    return places[:, :2] / places[:, 2:] / np.tan(FOV_RAD / 2) / [aspect, 1.0]


def test_performer_and_cameras_are_in_the_picture(works: Works) -> None:
    cameras = np.array([[3.4, 0.2, 1.0], [-2.0, -2.9, 1.6], [-1.8, 2.8, 1.0]])
    ends = np.concatenate([cameras, [[0.4, -0.3, 1.8], [0.4, -0.3, 0.0]]])
    for aspect in (0.6, 1.0, 1.78, 2.4):
        look = works("wholeStage", cameras, [[0.4, -0.3]], aspect)
        assert (np.abs(in_picture(ends, look, aspect)) < 1.0).all(), aspect


def test_the_picture_is_no_larger_than_it_needs_to_be(works: Works) -> None:
    points = np.random.default_rng(2).normal(0.0, 1.0, (50, 3))
    look = works("fit", points, [0.3, -1.0, 0.4], 1.5, 1.0)
    assert np.abs(in_picture(points, look, 1.5)).max() == pytest.approx(1.0)


def test_a_whole_motion_is_in_the_picture_and_fills_it(works: Works) -> None:
    rng = np.random.default_rng(3)
    walk = np.linspace([-1.5, 0.5, 0.0], [2.0, -0.5, 0.0], 40)
    joints = (walk[:, None] + rng.uniform([-0.3, -0.3, 0.05], [0.3, 0.3, 1.7], (40, 20, 3))).reshape(-1, 3)
    joints[7] = np.nan
    space = space_of(joints)
    assert 50 < len(space) <= 304
    for aspect in (0.9, 1.78, 2.4):
        look = works("wholeMotion", space, aspect)
        places = np.abs(in_picture(joints[np.isfinite(joints).all(axis=1)], look, aspect))
        assert 0.75 < places.max() < 1.0, aspect
        assert (np.abs(in_picture(np.array([[0.0, 0.0, 0.0]]), look, aspect)) < 1.0).all()


def test_a_motion_without_a_joint_takes_no_space() -> None:
    assert space_of(np.full((5, 3), np.nan)).shape == (0, 3)


def test_two_performers_and_cameras_are_in_the_picture(works: Works) -> None:
    two = [[-2.4, 0.3], [1.9, -0.8]]
    ends = np.array([[x, y, z] for x, y in two for z in (0.0, 1.8)])
    for aspect in (0.6, 1.78):
        for look in (
            works("wholeStage", np.array([[3.4, 0.2, 1.0]]), two, aspect),
            works("wholePerformers", two, [0.3, -1.0, 0.2], aspect),
        ):
            assert (np.abs(in_picture(ends, look, aspect)) < 1.0).all(), aspect
    assert works("middle", two) == pytest.approx([-0.25, -0.25])
    assert works("middle", []) == [0, 0]


def test_a_performer_who_is_followed_fills_the_picture(works: Works) -> None:
    for direction in ((0.3, -1.0, 0.2), (1.0, 0.0, 0.4), (0.0, 0.0, 1.0), (0.0, 0.0, 0.0)):
        look = works("wholePerformers", [[2.0, -1.0]], direction, 2.0)
        ends = in_picture(np.array([[2.0, -1.0, 0.0], [2.0, -1.0, 1.75]]), look, 2.0)
        assert (np.abs(ends) < 1.0).all() and abs(ends[1, 1] - ends[0, 1]) > 1.1  # of the 2 from edge to edge


def test_a_narrower_picture_holds_what_the_operators_does(works: Works) -> None:
    corners = np.array(list(itertools.product((-2.0, 2.0), (0.0, 1.0), (0.0, 2.0))))
    operators = works("fit", corners, [0.0, -1.0, 0.2], 1.8)
    for own in (0.5, 1.0, 1.79, 2.5):
        look = works("widened", {**operators, "aspect": 1.8}, own)
        assert look["target"] == operators["target"]
        assert (np.abs(in_picture(corners, look, own)) < 1.0).all(), own
        assert (look["position"] == operators["position"]) == (own > 1.78)
