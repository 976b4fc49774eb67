"""Replay on the page, in a real browser: open a solve, play, step, scrub, ghost, keys, back to the live stage."""

import httpx
import pytest
from playwright.sync_api import Page, Route, expect

from tests.web.playback.takes import FRAMES, take_with_solves
from tests.web.stages import until
from tests.web.test_page import serving, studio

pytestmark = pytest.mark.browser


@pytest.fixture
def address(tmp_path):
    """Address of a studio with two takes."""
    take_with_solves(tmp_path / "monday" / "one")
    take_with_solves(tmp_path / "monday" / "two", seed=1)
    with studio(tmp_path) as (app, _), serving(app) as url:
        yield url


def replay(address: str) -> dict:
    return httpx.get(f"{address}/api/v1/replay").json()


def test_a_solve_is_replayed_with_keys_and_pointer(address: str, page: Page) -> None:
    page.goto(address)
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
    page.keyboard.press("Escape")
    expect(page.locator("#replay")).to_be_hidden()
    assert replay(address) == {"open": False}


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


def test_the_shortcuts_are_shown(address: str, page: Page) -> None:
    page.goto(address)
    page.keyboard.press("?")
    expect(page.get_by_role("dialog")).to_contain_text("Ten frames back, on")
    page.keyboard.press("Escape")
    expect(page.get_by_role("dialog")).to_be_hidden()
    page.keyboard.press("2")
