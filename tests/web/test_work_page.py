"""The list of work on the page: the same in all browsers and after a reload, cancelled there, with reasons."""

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from playwright.sync_api import Browser, Locator, Page, expect

from tests.live.performer import calibration
from tests.web.browser import quiet_page
from tests.web.hits import covered
from tests.web.playback.takes import take_with_solves
from tests.web.servers import ThreadServer, thread_server
from tests.web.test_hits import works_held

pytestmark = [pytest.mark.browser, pytest.mark.timeout(600)]


@pytest.fixture
def server(tmp_path: Path) -> Iterator[ThreadServer]:
    """A server with a take of three solves and no raw frames."""
    sessions = tmp_path / "sessions"
    take_with_solves(sessions / "monday" / "one").add_calibration(calibration(["camera_0"]), use=True)
    with thread_server(sessions) as started:
        yield started


def export(server: ThreadServer, format: str = "fbx") -> dict[str, Any]:
    solve = server.http.get("/takes/monday/one").json()["solves"][0]
    answer = server.http.post(
        "/exports", json={"solves": [{"take": "monday/one", "solve": solve}], "format": format}
    )
    return answer.raise_for_status().json()


def opened(page: Page, server: ThreadServer) -> Page:
    page.goto(server.url)
    expect(page.locator("#preset")).to_be_visible()
    page.locator("#work-button").click()
    expect(page.locator("#work")).to_be_visible()
    return page


def cancel_button(page: Page, job: dict[str, Any]) -> Locator:
    return page.locator(f"#work-cancel-{job['id']}")


def test_work_is_listed_cancelled_and_told_in_all_browsers(chromium: Browser, server: ThreadServer) -> None:
    with quiet_page(chromium) as page, quiet_page(chromium) as other:
        opened(page, server)
        opened(other, server)
        expect(page.locator("#work-list")).to_contain_text("No work is under way")
        with works_held():
            made = [export(server) for _ in range(6)]
            last = cancel_button(page, made[-1])
            expect(last).to_be_visible()
            expect(cancel_button(other, made[-1])).to_be_visible()
            expect(page.locator("#work-count")).to_have_text(re.compile(r"\d"))
            expect(page.locator(".work-row.running progress")).to_be_visible()
            assert covered(page) == {}
            page.set_viewport_size({"width": 1280, "height": 720})
            last.click()
            for tab in (page, other):
                expect(tab.locator(".work-row.cancelled")).to_have_count(1)
            page.reload()
            expect(page.locator("#preset")).to_be_visible()
            page.keyboard.press("w")
            expect(page.locator(".work-row.cancelled")).to_have_count(1)
        expect(page.locator(".work-row.done")).to_have_count(5)
        with page.expect_download() as download:
            page.get_by_role("link", name=re.compile("^Download")).first.click()
        assert Path(download.value.path()).read_bytes().startswith(b"Kaydara FBX")
        page.locator("#work-clear").click()
        for tab in (page, other):
            expect(tab.locator("#work-list")).to_contain_text("No work is under way")
        work_that_runs_is_cancelled(page, server)
        page.keyboard.press("w")
        expect(page.locator("#work")).to_be_hidden()


def work_that_runs_is_cancelled(page: Page, server: ThreadServer) -> None:
    export(server)
    expect(page.locator(".work-row.done")).to_have_count(1)
    kept = {path.name for path in (server.sessions / "monday" / "one" / "exports").iterdir()}
    with works_held():
        job = export(server, "glb")
        cancel_button(page, job).click()
        expect(page.locator(".work-row.cancelling")).to_have_count(1)
        page.wait_for_timeout(1000)  # until its process has the word, which the server sends at its next look
    expect(page.locator(".work-row.cancelled")).to_have_count(1)
    assert {path.name for path in (server.sessions / "monday" / "one" / "exports").iterdir()} == kept


def test_why_work_failed_and_what_to_do(chromium: Browser, server: ThreadServer) -> None:
    page = chromium.new_page(viewport={"width": 1280, "height": 720})
    page.add_init_script("localStorage.setItem('language', 'fr')")
    page.goto(server.url)
    expect(page.locator("#preset")).to_be_visible()
    server.http.post("/takes/monday/one/solves", json={"preset": "raw"}).raise_for_status()
    expect(page.locator("#work-count.failed")).to_have_text("!")
    page.locator("#work-button").focus()
    page.keyboard.press("Enter")
    expect(page.locator(".work-row.failed .name")).to_have_text("Calcul raw")
    expect(page.locator(".work-row.failed .bad")).not_to_be_empty()
    expect(page.locator("#work-count")).to_be_empty()
    page.locator("#work-clear").focus()
    page.keyboard.press("Escape")
    expect(page.locator("#work")).to_be_hidden()
    page.close()
