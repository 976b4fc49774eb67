"""The cameras panel and the latency of poses, in a real browser on the real routes."""

import re
import time
from collections.abc import Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Page, expect

from tests.live.performer import save_stage_calibration
from tests.web.playback.takes import take_with_solves
from tests.web.stages import serving
from tests.web.test_page import NAMES, open_page, performing, studio

pytestmark = pytest.mark.browser


@pytest.fixture
def empty(tmp_path: Path) -> Iterator[str]:
    """Address of a studio without cameras, with a recorded take."""
    take_with_solves(tmp_path / "monday" / "one")
    with studio(tmp_path) as (app, _), serving(app) as url:
        yield url
        app.state.local_cameras.close()


def test_cameras_are_simulated_from_the_page_and_stopped(empty: str, page: Page) -> None:
    open_page(page, empty)
    page.get_by_role("button", name="Other cameras").click()
    dialog = page.get_by_role("dialog", name="Add a camera")
    page.locator("#add-source").select_option("azure-kinect")
    expect(dialog.locator("code", has_text="--server")).to_have_text(
        f"studio camera --source azure-kinect --server {empty}"
    )
    expect(dialog.get_by_role("img", name="QR code")).to_be_visible()
    expect(dialog).to_contain_text("This studio answers on its own machine only")
    dialog.get_by_role("button", name="Start simulated cameras").click()
    expect(page.locator(".camera")).to_have_count(2)
    first = page.locator(".camera").first
    expect(first.locator(".figures")).to_contain_text("fps")
    expect(first.locator("dd").last).to_contain_text("%")
    expect(page.locator("#calibration-badge")).to_have_text("calibrating")  # the performer walks by itself
    expect(page.locator("#wizard")).to_be_hidden()
    page.get_by_role("button", name="Stop these cameras").click()
    expect(first.locator(".health")).to_have_text("Disconnected")


def test_the_page_behind_the_code_has_the_command(empty: str, page: Page) -> None:
    page.goto(f"{empty}/camera#a-token")
    expect(page.locator("code", has_text="--server")).to_have_text(
        f"studio camera --source realsense --server {empty} --token a-token"
    )


@pytest.mark.viewing
def test_the_latency_of_poses_is_shown(tmp_path: Path, page: Page) -> None:
    save_stage_calibration(tmp_path, NAMES)
    with studio(tmp_path) as (app, _), serving(app) as url, performing(url):
        open_page(page, url)
        words = page.locator("#latency .value")
        expect(words).to_have_text(re.compile(r"Latency [\d,]+ ms, 95 % under [\d,]+ ms"))
        median, p95 = (
            int(number.replace(",", "")) for number in re.findall(r"([\d,]+) ms", words.inner_text())
        )
        assert 5 <= median <= p95 < 20_000  # however busy the machine is
        page.close()  # before the server, whose end it would complain of


BUSY = """if (parent === window) {
  const work = () => { const end = performance.now() + 150; while (performance.now() < end); setTimeout(work); };
  setTimeout(work);
}"""
"""Has the page's main thread do something else for nearly all of its time."""

POSES = """(offset) => {
  window.posing = setInterval(() => {
    const came = (performance.timeOrigin + performance.now()) / 1000, captured = came + offset - 0.05;
    for (let i = 0; i < 20; i += 1) postMessage({ type: "pose", came, captured, drawn: captured }, location.origin);
  }, 100);
}"""
"""Poses that come 50 ms after they were captured; `offset` of the server's clock [s]."""


def test_the_latency_is_right_where_the_page_is_busy(empty: str, page: Page) -> None:
    page.add_init_script(BUSY)
    page.goto(empty)
    page.evaluate(POSES, time.monotonic() - time.time())  # the server's clock, and the browser's
    value = page.locator("#latency .value")
    expect(value).to_contain_text("ms")
    shown = re.findall(r"-?\d+", value.inner_text())[0]
    assert 35 < int(shown) < 65, value.inner_text()
