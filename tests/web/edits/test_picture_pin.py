"""A joint is pinned in a camera's picture, in a real browser: its dot in the drawn skeleton is dragged."""

import json
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from playwright.sync_api import Page, expect

from studio.engine.base.geometry import transform_points
from studio.engine.edits.edit import PinEdit
from studio.take.edits.kept import read_edits
from studio.take.folder.take import Take
from tests import patient
from tests.take.video_takes import LENS, calibration, take_with_video
from tests.web.stages import serving, until
from tests.web.test_page import studio

pytestmark = pytest.mark.browser
CANVAS = "#video-canvas"
FRAME = 60
JOINT = "RightFoot"
MOVED, AGAIN = np.array([-0.08, -0.05]), np.array([-0.05, 0.06])
"""How far the joint is dragged, as shares of the picture."""


@pytest.fixture
def take(tmp_path: Path) -> Take:
    return take_with_video(tmp_path / "sessions" / "monday" / "one")


@pytest.fixture
def address(take: Take) -> Iterator[str]:
    with studio(take.path.parents[1]) as (app, _), serving(app) as url:
        yield url


def shares_of(place_m: tuple[float, float, float] | list[float]) -> tuple[np.ndarray, float]:
    """Where the camera `left` has a point in its picture, as shares, and how far away it is [m]."""
    local = transform_points(np.linalg.inv(calibration().cameras["left"].T_stage_camera), np.array(place_m))
    return (LENS.pixels_of(local) + 0.5) / (LENS.width, LENS.height), float(np.linalg.norm(local))


def pins(take: Take) -> list[PinEdit]:
    return [edit for edit in read_edits(take).edits if isinstance(edit, PinEdit)]


def test_a_joint_is_dragged_in_the_picture_to_where_it_was(address: str, take: Take, page: Page) -> None:
    page.goto(address)
    page.get_by_role("button", name="Replay one, solve studio").click()
    expect(page.locator("#replay-time")).to_contain_text("/")
    patient.patch(f"{address}/api/v1/replay", json={"frame": FRAME, "playing": False}).raise_for_status()
    page.keyboard.press("v")
    page.locator(f"{CANVAS}[data-frame='{FRAME}']").wait_for()
    shown = patient.get(f"{address}/api/v1/replay/video/left").json()
    picture = shown["pictures"][FRAME]
    order = shown["order"].index(picture)
    drawn = f"{address}/api/v1/replay/video/left/drawn?first={order}&last={order}"
    (figure,) = patient.get(drawn).json()["skeleton"]
    at = np.array(figure).reshape(-1, 2)[shown["skeleton_joints"].index(JOINT)] / 1e4

    assert 0.1 < at.min() and at.max() < 0.9

    def pointer(shares: np.ndarray) -> tuple[float, float]:
        box = page.locator(CANVAS).bounding_box()
        place = json.loads(page.locator(CANVAS).get_attribute("data-place") or "")
        assert box is not None
        x, y = np.array([box["x"], box["y"]]) + (place["left"], place["top"]) + shares * (
            place["width"], place["height"],
        )  # fmt: skip
        return float(x), float(y)

    def drag(shares: np.ndarray) -> None:
        page.mouse.move(*pointer(at))
        page.mouse.down()
        page.mouse.move(*pointer(shares), steps=3)

    def hint() -> str | None:
        page.mouse.move(*pointer(at))
        return page.locator(CANVAS).get_attribute("title")

    until(lambda: hint() == "Drag to where this is: right ankle")
    drag(at + MOVED)
    page.keyboard.press("Escape")
    page.mouse.up()
    drag(at + MOVED)
    page.mouse.up()
    until(lambda: len(pins(take)) == 1)
    (pin,) = pins(take)
    assert (pin.joint, pin.performer, pin.start_s) == ("right_ankle", "performer_1", pin.end_s)
    solved = patient.get(f"{address}/api/v1/replay/joints?frame={FRAME}").json()["positions_m"][JOINT]
    found, away_m = shares_of(pin.place_m)
    np.testing.assert_allclose(found, at + MOVED, atol=0.006)
    assert away_m == pytest.approx(shares_of(solved)[1], abs=0.05)

    drag(at + AGAIN)  # the same joint at the same time: its pin is moved
    page.mouse.up()
    until(lambda: shares_of(pins(take)[0].place_m)[0] == pytest.approx(at + AGAIN, abs=0.006))
    assert len(pins(take)) == 1


def test_places_that_are_none(take: Take) -> None:
    asked = {"picture": 10, "x": 0.5, "y": 0.5, "near_x": 0.0, "near_y": 0.0, "near_z": 1.0}
    with studio(take.path.parents[1]) as (app, _), serving(app) as url:
        patient.put(f"{url}/api/v1/replay", json={"take": "monday/one", "solve": "studio"}).raise_for_status()
        for changed, code in (
            ({"camera": "right"}, "video.none_kept"),
            ({"picture": 9999}, "video.no_number"),
            ({"near_x": float("nan")}, "video.no_ray"),
            ({"x": 1.5}, None),
        ):
            values = {"camera": "left", **asked, **changed}
            camera = values.pop("camera")
            answer = patient.get(f"{url}/api/v1/replay/video/{camera}/place", params=values)
            assert 400 <= answer.status_code < 500
            if code:
                assert answer.json()["error"]["said"][0]["code"] == code
