"""Controls are never covered: every control is hit in every state, at three sizes, dark and light."""

import re
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import psutil
import pytest
from playwright.sync_api import Browser, Page, expect

from tests.acceptance.processes import ServerProcess, server_process, wait_until
from tests.live.performer import calibration, save_stage_calibration
from tests.web.hits import covered
from tests.web.playback.takes import take_with_solves
from tests.web.servers import ThreadServer, thread_server
from tests.web.test_fresh_page import performing
from tests.web.test_language import CHOOSE
from tests.web.test_page import NAMES

THEME = """(theme) => {
  if (document.documentElement.dataset.theme !== theme) document.querySelector("#theme").click();
}"""
"""Changes the theme, also while a dialog lies over its button."""

pytestmark = [pytest.mark.browser, pytest.mark.timeout(1800)]


@pytest.fixture
def sessions(tmp_path: Path) -> Path:
    """A folder with two calibrated cameras to come, and a take."""
    sessions = tmp_path / "sessions"
    save_stage_calibration(sessions, NAMES)
    take_with_solves(sessions / "monday" / "one").add_calibration(calibration(["camera_0"]), use=True)
    return sessions


@pytest.fixture
def page(chromium: Browser) -> Iterator[Page]:
    tab = chromium.new_page(viewport={"width": 1280, "height": 720})
    tab.add_init_script("localStorage.setItem('language', 'en'); localStorage.setItem('theme', 'dark')")
    yield tab
    tab.close()


def open_stage(page: Page, url: str) -> None:
    page.goto(url)
    expect(page.locator("body")).to_have_attribute("data-connection", "open")
    expect(page.locator("#preset")).to_be_visible()


def look_like(page: Page, language: str, theme: str) -> None:
    """Change language and theme in place."""
    page.evaluate(CHOOSE, language)
    page.evaluate(THEME, theme)
    expect(page.locator("html")).to_have_attribute("lang", language)
    expect(page.locator("html")).to_have_attribute("data-theme", theme)


def assert_reached(page: Page, *shown: str) -> None:
    """Every control is hit, in French and light, and in English and dark, as which the page is left; `shown` is what
    makes the state, seen before and after."""
    for language, theme in (("fr", "light"), ("en", "dark")):
        look_like(page, language, theme)
        for which in shown:
            expect(page.locator(which).first).to_be_visible()
        assert covered(page) == {}, (language, shown)
        for which in shown:
            assert page.locator(which).first.is_visible(), f"{which} has gone while it was looked at"
        page.set_viewport_size({"width": 1280, "height": 720})


def refuse_a_value(page: Page) -> None:
    """Show an error: enter a value that the server refuses."""
    page.evaluate("document.querySelector('#switches').open = true")
    page.fill("#switch-look_at_point_m", "over there")
    page.keyboard.press("Enter")
    expect(page.locator("#messages .error")).to_be_visible()


def dismiss(page: Page) -> None:
    """Undo the refused value, and close its error."""
    page.get_by_role("button", name="Dismiss").first.click()
    expect(page.locator("#messages .error")).to_have_count(0)
    page.evaluate("document.querySelector('#switches').open = false")


def open_replay(page: Page) -> None:
    page.locator(".take-picture").first.click()
    expect(page.locator("#replay-bar button").first).to_be_visible()


def test_from_no_camera_to_a_server_that_was_lost_and_came_back(page: Page, sessions: Path) -> None:
    with server_process(sessions) as server:
        from_no_camera_to_a_server_that_was_lost_and_came_back(page, server)


def from_no_camera_to_a_server_that_was_lost_and_came_back(page: Page, server: ServerProcess) -> None:
    open_stage(page, server.url)
    assert_reached(page, "#guide")
    refuse_a_value(page)
    assert_reached(page, "#guide", "#messages .error")
    dismiss(page)
    with performing(server.url):
        expect(page.locator("#record")).to_be_enabled()
        assert_reached(page, "#record")
        page.locator("#record").click()
        assert_reached(page, ".recording #timer")
        refuse_a_value(page)
        assert_reached(page, ".recording #timer", "#messages .error")
        dismiss(page)
        page.locator("#record").click()
        expect(page.locator("#record")).to_have_attribute("aria-pressed", "false")
        page.evaluate("localStorage.setItem('countdown', 600)")  # longer than all controls are looked at
        page.locator("#record").click()
        assert_reached(page, "#countdown")
        page.locator("#record").click()
        page.locator("#calibrate").click()
        assert_reached(page, "#wizard")
        page.keyboard.press("Escape")
        server.http.post("/tpose/start", json={"performer": ""}).raise_for_status()
        assert_reached(page, "#wizard[data-step=pose]")
        server.http.post("/tpose/cancel").raise_for_status()
        page.keyboard.press("Escape")
        server.record("resumed")
        expect(page.locator(".recording #timer")).to_be_visible()
        server.kill()
    assert_reached(page, "#curtain")
    server.start()
    assert_reached(page, "#banner", ".recording #timer")  # no camera is connected, and the take goes on


@contextmanager
def works_held() -> Iterator[None]:
    """The worker processes of a server in this process are paused."""
    children = psutil.Process().children(recursive=True)
    workers = [child for child in children if "from multiprocessing" in " ".join(child.cmdline())]
    for worker in workers:
        worker.suspend()
    try:
        yield
    finally:
        for worker in workers:
            worker.resume()


def test_while_a_take_is_replayed_compared_exported_and_solved(page: Page, sessions: Path) -> None:
    with thread_server(sessions) as server:
        while_a_take_is_replayed_compared_exported_and_solved(page, server)


def while_a_take_is_replayed_compared_exported_and_solved(page: Page, server: ThreadServer) -> None:
    open_stage(page, server.url)
    open_replay(page)
    assert_reached(page, "#replay")
    page.locator("#replay-video").click()
    assert_reached(page, "#replay", "#video #video-close")
    page.locator("#video-close").click()
    page.locator("#replay-compare").click()
    assert_reached(page, "#compare")
    page.locator("#compare-close").click()
    page.locator("[aria-label*='one']").locator("visible=true").filter(
        has_text=re.compile("^Exp")
    ).first.click()
    assert_reached(page, "#export-dialog")
    page.keyboard.press("Escape")
    expect(page.locator("#export-dialog")).to_be_hidden()
    with performing(server.url):
        wait_until(
            lambda: not server.http.get("/status").json()["pipeline"]["preparing"], "the solver is ready"
        )
        server.record("solved")
        page.wait_for_timeout(2000)  # so long the take is
        server.stop()
    solves = "/takes/tests/solved/solves"
    for number in range(12):  # the trial waits for its turn behind them
        server.http.post(solves, json={"preset": "finish", "name": f"before_{number}"}).raise_for_status()
    server.http.post(solves, json={"preset": "finish", "name": "trial"}).raise_for_status()
    solved = page.locator(".take").filter(has_text="solved")
    with works_held():
        expect(solved.locator(".solve-row").first).to_be_visible()
        solved.locator(".take-picture").click()
        assert_reached(page, "#replay", "#trial progress")
        page.locator("#replay-compare").click()
        assert_reached(page, "#compare", "#trial progress")
