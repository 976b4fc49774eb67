"""Replay on the page, in a real browser: open a solve, play, step, scrub, ghost, keys, back to the live stage."""

import re

import pytest
from playwright.sync_api import Page, Route, expect

from studio.engine.timecode.course import course
from studio.engine.timecode.timecode import RATES
from studio.take.timecode.kept import save_course
from tests import patient
from tests.web.playback.takes import FRAMES, take_with_solves
from tests.web.stages import until
from tests.web.test_page import serving, studio

pytestmark = pytest.mark.browser


@pytest.fixture
def address(tmp_path):
    """Address of a studio with two takes."""
    readings = [(0.04 * k, 900_000 + k) for k in range(300) if k not in range(20, 30)]
    take = take_with_solves(tmp_path / "monday" / "one")
    save_course(take, course(readings, RATES["25"], "ltc"))
    take.meta["timecode_rate"] = "25"
    take.save_meta()
    take_with_solves(tmp_path / "monday" / "two", seed=1)
    with studio(tmp_path) as (app, _), serving(app) as url:
        yield url


def replay(address: str) -> dict:
    return patient.get(f"{address}/api/v1/replay").json()


def _ends_above(page: Page, which: str, y: float) -> bool:
    box = page.locator(which).bounding_box()  # None for a moment where it is drawn anew
    return box is not None and box["y"] + box["height"] < y


def test_a_solve_is_replayed_with_keys_and_pointer(address: str, page: Page) -> None:
    page.goto(address)
    expect(page.locator("#cameras-title")).to_be_visible()
    page.get_by_role("button", name="Replay one, solve studio").click()
    expect(page.locator("#replay-time")).to_contain_text(f"0 / {FRAMES - 1}")
    page.keyboard.press("ArrowRight")
    page.keyboard.press("Shift+ArrowRight")
    expect(page.locator("#replay-time")).to_contain_text(f"11 / {FRAMES - 1}")
    page.keyboard.press("i")
    page.keyboard.press("End")
    page.keyboard.press("Home")
    expect(page.locator("#replay-time")).to_contain_text(f"11 / {FRAMES - 1}")
    box = page.locator("#timeline").bounding_box()
    page.mouse.click(box["x"] + box["width"] - 2, box["y"] + 20)
    expect(page.locator("#replay-time")).to_contain_text(f"{FRAMES - 1} / {FRAMES - 1}")
    page.keyboard.press("Space")
    expect(page.locator("#replay-play")).to_have_attribute("aria-label", "Pause")
    page.keyboard.press("l")
    expect(page.locator("#replay-loop")).to_have_attribute("aria-pressed", "false")
    page.locator("#replay-unit").click()
    page.locator("#replay-unit").click()
    expect(page.locator("#replay-unit")).to_have_text("TC")
    expect(page.locator("#replay-unit")).to_have_attribute("title", re.compile("ltc 25, -?0.0 ppm, 1 part"))
    page.keyboard.press("Escape")
    expect(page.locator("#replay")).to_be_hidden()
    assert replay(address) == {"open": False}
    page.keyboard.press("?")
    expect(page.get_by_role("dialog")).to_contain_text("Ten frames back, on")
    page.keyboard.press("Escape")
    expect(page.get_by_role("dialog")).to_be_hidden()
    page.keyboard.press("2")
    what_concerns_the_open_take_stands_first(page)


def what_concerns_the_open_take_stands_first(page: Page) -> None:
    page.get_by_role("button", name="Replay one, solve studio").click()
    expect(page.locator("#open-take")).to_contain_text("one")
    expect(page.locator("#cameras-title")).to_be_hidden()
    for which in ("#open-take .primary", "#preset"):
        expect(page.locator(which)).to_be_visible()
        until(lambda which=which: _ends_above(page, which, 720))
    page.locator("#live-panels").click()
    expect(page.locator("#cameras-title")).to_be_visible()
    page.keyboard.press("Escape")
    expect(page.locator("#open-take-panel")).to_be_hidden()
    expect(page.locator("#cameras-title")).to_be_visible()


def test_state_survives_a_reload_and_a_ghost_is_chosen(address: str, page: Page) -> None:
    page.goto(address)
    page.get_by_role("button", name="Replay one, solve studio").click()
    page.locator("#replay-compare").click()
    page.locator("#compare-b").select_option("monday/two|studio")
    expect(page.locator("#replay-value")).to_contain_text("m")
    page.locator("#replay-joint").select_option("RightFoot")
    page.locator("#replay-joint").focus()
    page.keyboard.press("End")  # in a list it chooses, it does not step
    until(lambda: replay(address)["ghost"] == {"take": "monday/two", "solve": "studio"})
    page.reload()
    expect(page.locator("#replay-time")).to_contain_text(f"0 / {FRAMES - 1}")
    assert replay(address)["ghost"] == {"take": "monday/two", "solve": "studio"}


def test_of_two_quick_choices_the_second_stands(address: str, page: Page) -> None:
    held: list[Route] = []

    def hold_the_first(route: Route) -> None:
        held.append(route)
        if len(held) > 1:
            route.continue_()

    page.goto(address)
    page.get_by_role("button", name="Replay one, solve studio").click()
    page.locator("#replay-compare").wait_for()
    page.route("**/api/v1/replay", hold_the_first)
    page.locator("#replay-compare").click()  # asks for the take's other solve beside it
    page.locator("#compare-b").select_option("monday/two|studio")
    until(lambda: page.evaluate("true") and len(held) > 0)  # the browser is heard while it is asked
    assert len(held) == 1
    held[0].continue_()
    until(lambda: page.evaluate("true") and len(held) == 2)
    expect(page.locator("#compare-b")).to_have_value("monday/two|studio")
    until(lambda: replay(address)["ghost"] == {"take": "monday/two", "solve": "studio"})


def open_one(address: str, page: Page) -> dict:
    page.goto(address)
    page.get_by_role("button", name="Replay one, solve studio").click()
    expect(page.locator("#replay-value")).to_contain_text("m")
    box = page.locator("#timeline").bounding_box()
    assert box is not None
    return box


def test_markers_are_set_and_the_timeline_zooms_snaps_and_takes_a_range(address: str, page: Page) -> None:
    box = open_one(address, page)
    markers_are_set_named_removed_and_taken_back(address, page)
    the_timeline_zooms_snaps_and_takes_a_range(address, page, box)


def markers_are_set_named_removed_and_taken_back(address: str, page: Page) -> None:
    page.keyboard.press("Shift+ArrowRight")
    page.keyboard.press("m")
    expect(page.locator("#messages")).to_contain_text("Marker 1 is set")
    page.keyboard.press("End")
    page.keyboard.press("m")
    page.locator("#replay-markers").click()
    expect(page.locator("#marker-list li")).to_have_count(2)
    page.locator("#marker-0").fill("kick")
    page.locator("#marker-0").press("Enter")
    until(lambda: [one["name"] for one in markers(address)] == ["kick", "Marker 2"])
    page.locator("#marker-list li").first.get_by_role("button", name="Frame 10").click()
    expect(page.locator("#replay-time")).to_contain_text(f" 10 / {FRAMES - 1}")
    page.get_by_role("button", name="Remove Marker 2").click()
    expect(page.locator("#marker-list li")).to_have_count(1)
    page.locator("h1").click()
    page.keyboard.press("Control+z")
    expect(page.locator("#marker-list li")).to_have_count(2)
    assert [one["name"] for one in markers(address)] == ["kick", "Marker 2"]
    for left in (1, 0):  # then there is nothing to snap to
        page.locator("#marker-list li").first.get_by_role("button", name="Remove").click()
        expect(page.locator("#marker-list input")).to_have_count(left)
    page.locator("#replay-markers").click()


def the_timeline_zooms_snaps_and_takes_a_range(address: str, page: Page, box: dict) -> None:
    gutter, right = 96, 6
    width = box["width"] - gutter - right

    def x_of(frame: float) -> float:
        return box["x"] + gutter + frame / (FRAMES - 1) * width

    page.mouse.move(x_of(30), box["y"] + 8)  # on the ruler
    page.mouse.down()
    page.mouse.move(x_of(90), box["y"] + 8, steps=3)
    page.mouse.up()
    until(lambda: (replay(address)["first"], replay(address)["last"]) == (30, 90))
    # where the ends touch, the nearer one is dragged
    for begin, end, first, last in ((90, 31, 30, 31), (31, 90, 30, 90)):
        page.mouse.move(x_of(begin), box["y"] + 8)
        page.keyboard.down("Alt")  # without snapping
        page.mouse.down()
        page.mouse.move(x_of(end), box["y"] + 8, steps=3)
        page.mouse.up()
        page.keyboard.up("Alt")
        until(lambda want=(first, last): (replay(address)["first"], replay(address)["last"]) == want)
    page.mouse.click(x_of(90) + 3, box["y"] + 60)  # beside the range's end
    until(lambda: replay(address)["frame"] == 90)
    page.mouse.move(x_of(90), box["y"] + 60)
    for _ in range(6):
        page.mouse.wheel(0, -100)
    page.mouse.click(box["x"] + gutter + 1, box["y"] + 60)
    until(lambda: 60 < replay(address)["frame"] < 90)  # the left end is no longer the first frame
    page.keyboard.press("0")
    page.mouse.click(box["x"] + gutter + 1, box["y"] + 60)
    until(lambda: replay(address)["frame"] == 0)
    page.keyboard.press("ArrowRight")
    page.keyboard.press("[")
    until(lambda: replay(address)["first"] == 1)


def markers(address: str) -> list[dict]:
    return patient.get(f"{address}/api/v1/takes/monday/one").json()["meta"].get("markers", [])
