"""Habits of the page in a real browser: language, theme, undo, trash, presets, countdown, warnings, viewers."""

import re
import threading
from collections.abc import Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Page, Route, expect

from studio.live import warmup
from studio.take.folder.take import Take
from tests import patient
from tests.live.performer import calibration, hello, save_stage_calibration
from tests.web.browser import wait_for_undos
from tests.web.playback.takes import take_with_solves
from tests.web.stages import serving, until
from tests.web.test_page import FAINT, NAMES, open_page, performing, studio

pytestmark = pytest.mark.browser


@pytest.fixture
def empty(tmp_path: Path) -> Iterator[str]:
    """Address of a studio with two takes and no camera."""
    for seed, name in enumerate(("one", "two")):
        take_with_solves(tmp_path / "monday" / name, seed=seed)
    with studio(tmp_path) as (app, _), serving(app) as url:
        yield url


def test_a_viewer_changes_nothing_and_language_theme_and_folded_panels_survive_a_reload(
    empty: str, page: Page
) -> None:
    page.emulate_media(color_scheme="dark")
    a_viewer_sees_all_and_changes_nothing(empty, page)
    open_page(page, empty)
    assert page.evaluate("document.documentElement.lang") == "en"
    assert page.evaluate(FAINT) == []
    page.locator("#theme").click()
    page.locator("#takes-title-fold").click()
    expect(page.locator("#takes")).to_be_hidden()
    page.get_by_label("Language").select_option("fr")
    expect(page.locator("#record .label")).to_have_text("Enregistrer")
    expect(page.locator("#connection")).to_have_text("Connecté")
    assert page.evaluate("[document.documentElement.lang, document.documentElement.dataset.theme]") == [
        "fr",
        "light",
    ]
    expect(page.locator("#takes")).to_be_hidden()
    page.locator("#takes-title-fold").click()
    expect(page.locator(".take")).to_have_count(2)
    assert page.evaluate(FAINT) == []


def a_viewer_sees_all_and_changes_nothing(empty: str, page: Page) -> None:
    open_viewer(page, f"{empty}/?view")
    expect(page.locator(".take")).to_have_count(2)
    expect(page.locator("#record")).to_be_hidden()
    expect(page.locator(".side").get_by_role("button", name="Export")).to_have_count(0)
    page.keyboard.press("r")
    page.keyboard.press("t")
    assert not patient.get(f"{empty}/api/v1/status").json()["recording"]["active"]
    assert page.evaluate("document.documentElement.scrollWidth <= innerWidth")


def test_a_page_waits_for_its_own_words_and_program(empty: str, page: Page) -> None:
    """French shows no English words before, and the browser never sends the sign-in by itself."""
    the_browser_never_sends_the_sign_in_by_itself(empty, page)
    page.add_init_script("localStorage.setItem('language', 'fr')")
    held: list[Route] = []
    page.route("**/static/stage/main.js*", lambda route: held.append(route))
    page.goto(empty, wait_until="commit")
    until(lambda: page.evaluate("document.querySelector('h1') !== null") and len(held) > 0)
    expect(page.locator("h1")).to_be_hidden()
    for route in held:
        route.continue_()
    expect(page.locator("#record .label")).to_have_text("Enregistrer")
    expect(page.locator("h1")).to_be_visible()


def the_browser_never_sends_the_sign_in_by_itself(empty: str, page: Page) -> None:
    held: list[Route] = []
    page.route("**/static/access/signin.js*", lambda route: held.append(route))
    page.goto(f"{empty}/signin", wait_until="commit")
    until(lambda: page.evaluate("document.querySelector('#sign-in') !== null") and len(held) > 0)
    button = page.locator("#sign-in button")
    expect(button).to_be_disabled()
    held[0].continue_()
    expect(button).to_be_enabled()


def test_every_act_on_takes_can_be_taken_back(empty: str, page: Page) -> None:
    open_page(page, empty)
    one = page.locator(".take").filter(has_text="one")
    one.get_by_role("button", name="Remove solve live of one").click()
    expect(one.locator(".solve-row")).to_have_count(1)
    one.get_by_role("button", name="Edit one").click()
    page.locator("#slate-name").fill("best")
    page.keyboard.press("Enter")
    best = page.locator(".take").filter(has_text="best")
    expect(best).to_be_visible()
    wait_for_undos(page, 2)
    page.locator("h1").click()
    page.keyboard.press("Control+z")
    expect(one).to_be_visible()
    page.reload()  # what can be taken back outlives it, in its order
    expect(one).to_be_visible()
    page.locator("h1").click()
    page.keyboard.press("Control+z")
    expect(one.locator(".solve-row")).to_have_count(2)
    one.get_by_role("button", name="Edit one").click()
    page.get_by_role("button", name="Throw away one").click()
    expect(page.locator(".take")).to_have_count(1)
    page.locator("#trash-open").click()
    page.get_by_role("button", name="Put back one").click()
    expect(page.locator("#trash")).to_contain_text("Nothing was thrown away")
    expect(page.locator(".take")).to_have_count(2)
    patient.delete(f"{empty}/api/v1/takes/monday/two").raise_for_status()
    page.get_by_role("button", name="Close").click()
    page.locator("#trash-open").click()
    page.get_by_role("button", name="Empty the trash").click()
    page.locator(".ask").get_by_role("button", name="Cancel").click()
    assert len(patient.get(f"{empty}/api/v1/trash").json()) == 1
    page.get_by_role("button", name="Empty the trash").click()
    page.locator(".ask").get_by_role("button", name="Empty the trash").click()
    expect(page.locator("#trash")).to_contain_text("Nothing was thrown away")
    assert patient.get(f"{empty}/api/v1/trash").json() == []


def test_presets_are_saved_renamed_removed_and_put_back(empty: str, page: Page) -> None:
    open_page(page, empty)
    page.locator("#switches > summary").click()
    page.select_option("#switch-hands", "off")
    page.get_by_role("button", name="Save as").click()
    page.locator(".ask input").fill("duel")
    page.keyboard.press("Enter")
    expect(page.locator("#preset")).to_have_value("duel")
    expect(page.locator("#solve-summary")).to_have_text("")
    page.get_by_role("button", name="Rename", exact=True).click()
    page.locator(".ask input").fill("sword fight")
    page.keyboard.press("Enter")
    expect(page.locator("#preset")).to_have_value("sword fight")
    page.locator("#solve").get_by_role("button", name="Remove", exact=True).click()
    expect(page.locator("#preset")).to_have_value("studio")
    page.locator("h1").click()
    page.keyboard.press("Control+z")
    expect(page.locator("#preset")).to_have_value("sword fight")
    page.select_option("#switch-smoothing", "holt:after")
    page.get_by_role("button", name="Reset").click()
    expect(page.locator("#switch-smoothing")).to_have_value("none")
    page.locator("h1").click()
    page.keyboard.press("Control+z")
    expect(page.locator("#switch-smoothing")).to_have_value("holt:after")


def test_a_countdown_a_slate_and_a_warning(tmp_path: Path, page: Page) -> None:
    save_stage_calibration(tmp_path, NAMES)
    with studio(tmp_path) as (app, _), serving(app) as url:
        with performing(url):
            open_page(page, url)
            expect(page.locator("#record")).to_be_enabled()
            expect(page.locator("#take-name")).to_have_attribute("placeholder", "take_001")
            page.locator("#countdown-seconds").select_option("3")
            page.locator("h1").click()
            page.keyboard.press("r")
            expect(page.locator("#countdown .number")).to_have_text(re.compile("[123]"))
            page.keyboard.press("Escape")
            expect(page.locator("#countdown")).to_be_hidden()
            page.keyboard.press("r")
            expect(page.locator("#record .label")).to_have_text("Stop")
            expect(page.locator("#countdown")).to_be_hidden()
            expect(page.get_by_role("meter", name="Level of camera_0")).to_be_visible()
        expect(page.locator("#warning")).to_contain_text("no frames")
        patient.post(f"{url}/api/v1/record/stop").raise_for_status()
        expect(page.locator("#warning")).to_be_hidden()
        page.close()  # before the server, whose end it would complain of


def open_viewer(page: Page, url: str) -> None:
    page.goto(url)
    expect(page.locator("#connection")).to_have_text("Connected")


def test_a_take_is_calibrated_like_another_one(tmp_path: Path, page: Page) -> None:
    for name in ("one", "two"):
        take = take_with_solves(tmp_path / "monday" / name)
        take.add_camera(hello("camera_0"))
        take.save_meta()
    take.add_calibration(calibration(["camera_0"]), use=True)
    with studio(tmp_path) as (app, _), serving(app) as url:
        open_page(page, url)
        uncalibrated = page.locator(".take").filter(has_text="not calibrated")
        uncalibrated.get_by_role("button", name="Calibrate one").click()
        page.locator(".ask select").select_option("monday/two")
        page.locator(".ask").get_by_role("button", name="Calibrate").click()
        expect(page.get_by_role("button", name="Solve one", exact=True)).to_be_visible()
        page.close()  # before the server, whose end it would complain of
    assert Take.open(tmp_path / "monday" / "one").meta["calibration"] == 1


def test_the_page_says_that_the_solver_is_being_prepared(
    tmp_path: Path, page: Page, monkeypatch: pytest.MonkeyPatch
) -> None:
    ready = threading.Event()
    for name in ("_ready", "_ready_for_pictures"):
        monkeypatch.setattr(warmup, name, ready)
    monkeypatch.setattr(warmup, "_prepare", lambda *what: ready.wait(60))
    save_stage_calibration(tmp_path, NAMES)
    with studio(tmp_path) as (app, _), serving(app) as url, performing(url):
        open_page(page, url)
        expect(page.locator("#notice")).to_contain_text("Preparing the solver")
        ready.set()
        expect(page.locator("#notice")).to_be_hidden()
        page.close()  # before the server, whose end it would complain of
