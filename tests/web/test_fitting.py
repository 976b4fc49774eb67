"""Every page fits a laptop, a large screen and a phone: nothing lies beyond the edge."""

from collections.abc import Iterator

import pytest
from playwright.sync_api import Page, expect

from tests import patient
from tests.live.performer import calibration
from tests.web.fitting import assert_it_fits
from tests.web.playback.takes import take_with_solves
from tests.web.test_page import FAINT, NAMELESS, open_page, serving, studio
from tests.web.test_vote_page import make_test

pytestmark = pytest.mark.browser


@pytest.fixture(scope="module")
def address(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    """Address of a studio with a take and no camera."""
    sessions = tmp_path_factory.mktemp("sessions")
    take = take_with_solves(sessions / "monday" / "one")
    take.add_calibration(calibration(["camera_0"]), use=True)
    with studio(sessions) as (app, _), serving(app) as url:
        yield url


@pytest.fixture(scope="module")
def trial(address: str) -> dict:
    """A blind test with a vote."""
    made = make_test(address, allow_none=True, ask_name=True)
    vote = f"{address}/api/v1{made['path']}"
    voter = {"X-Voter": patient.post(f"{vote}/join", json={"name": "Ada"}).json()["voter"]}
    chosen = {"choice": "left", "watched_s": 3.0, "comment": "the feet stand still in this one"}
    patient.put(f"{vote}/0", json=chosen, headers=voter).raise_for_status()
    return made


def test_the_stage_without_a_camera_and_its_dialogs(address: str, page: Page) -> None:
    open_page(page, address)
    expect(page.locator("#guide")).to_be_visible()
    assert_it_fits(page)
    page.get_by_role("button", name="Other cameras").click()
    expect(page.locator("#add-camera-dialog")).to_be_visible()
    assert_it_fits(page)
    page.keyboard.press("Escape")
    page.get_by_role("button", name="Share one, solve studio").click()
    expect(page.locator(".sharing")).to_be_visible()
    assert_it_fits(page)
    page.keyboard.press("Escape")
    page.get_by_role("button", name="Export one, solve studio").click()
    page.locator("#export-advanced > summary").click()
    assert_it_fits(page)


@pytest.mark.parametrize("path", ["/remote", "/signin", "/camera", "/?view"])
def test_the_smaller_pages(address: str, page: Page, path: str) -> None:
    page.goto(address + path)
    expect(page.locator("h1").first).to_be_visible()
    assert_it_fits(page)
    assert page.evaluate(NAMELESS) == [] and page.evaluate(FAINT) == []


@pytest.mark.parametrize("language", ["en", "fr"])
def test_the_page_of_blind_tests_with_results(address: str, trial: dict, page: Page, language: str) -> None:
    page.add_init_script(f"localStorage.setItem('language', '{language}')")
    page.goto(f"{address}/blind#{trial['id']}")
    expect(page.locator(".result .bar")).to_have_count(1)
    expect(page.locator("#make")).to_be_visible()
    assert_it_fits(page)
    assert page.evaluate(NAMELESS) == [] and page.evaluate(FAINT) == []


def test_the_voters_page_has_its_choices_in_one_row(address: str, trial: dict, page: Page) -> None:
    page.goto(address + trial["path"])
    assert_it_fits(page)
    page.get_by_role("button", name="Begin").click()
    expect(page.locator("body")).to_have_attribute("data-ready", "0")
    for width in (390, 1280):
        page.set_viewport_size({"width": width, "height": 844})
        boxes = [one.bounding_box() for one in page.locator(".choice").all()]
        assert len(boxes) == 3 and len({box["y"] for box in boxes if box}) == 1
    assert_it_fits(page)


def test_a_shared_replay(address: str, page: Page) -> None:
    share = patient.post(f"{address}/api/v1/takes/monday/one/solves/studio/share", timeout=60).json()
    page.goto(address + share["path"])
    expect(page.locator("body")).to_have_attribute("data-ready", "")
    assert_it_fits(page)
