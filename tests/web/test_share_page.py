"""A replay that was given away, in a real browser: from a file without any network, and behind its link."""

import re
from pathlib import Path

import numpy as np
import pytest
from playwright.sync_api import Page, expect

from studio.review.share.page import replay_page
from tests import patient
from tests.poses_factory import random_poses
from tests.web.playback.takes import take_with_solves
from tests.web.stages import until
from tests.web.test_page import serving, studio

pytestmark = pytest.mark.browser

RESTS = """async () => {
  const { drawn } = document.body.dataset;
  for (let frame = 0; frame < 3; frame += 1) await new Promise((next) => { requestAnimationFrame(next); });
  return drawn !== undefined && drawn === document.body.dataset.drawn;
}"""
LOSES_ITS_PICTURES = """() => {
  const context = document.querySelector("canvas").getContext("webgl2").getExtension("WEBGL_lose_context");
  context.loseContext();
  setTimeout(() => context.restoreContext(), 100);
}"""


def test_the_file_plays_without_a_network(page: Page, tmp_path: Path) -> None:
    file = tmp_path / "walk.html"
    file.write_bytes(replay_page(random_poses(np.random.default_rng(1), seconds=2.0), title="Walk"))
    asked: list[str] = []
    page.on("request", lambda request: asked.append(request.url))
    page.goto(file.as_uri())
    expect(page.locator("body")).to_have_attribute("data-ready", "")
    expect(page.get_by_role("heading")).to_have_text("Walk")
    page.keyboard.press("Space")
    expect(page.locator("#play")).to_have_attribute("aria-label", "Play (Space)")
    page.keyboard.press("Home")
    expect(page.locator("#time")).to_have_text("0:00.00 / 0:02.00")
    page.keyboard.press("Shift+ArrowRight")
    expect(page.locator("#time")).to_have_text("0:00.33 / 0:02.00")
    before = page.locator("canvas").screenshot()
    page.keyboard.press("End")
    expect(page.locator("#time")).to_have_text("0:02.00 / 0:02.00")
    until(lambda: page.locator("canvas").screenshot() != before)
    page.locator("#loop").click()
    expect(page.locator("#loop")).to_have_attribute("aria-pressed", "false")
    page.locator("#play").click()  # at the end it begins again, and stops there
    expect(page.locator("#play")).to_have_attribute("aria-label", "Play (Space)")
    expect(page.locator("#time")).to_have_text("0:02.00 / 0:02.00")
    page.set_viewport_size({"width": 390, "height": 844})
    assert page.evaluate("document.documentElement.scrollWidth <= innerWidth")
    assert [url for url in asked if not url.startswith(("file:", "blob:"))] == []


def test_every_button_has_its_name_before_the_first_picture(page: Page, tmp_path: Path) -> None:
    file = tmp_path / "walk.html"
    file.write_bytes(replay_page(random_poses(np.random.default_rng(1), seconds=1.0), title="Walk"))
    page.add_init_script("window.requestAnimationFrame = () => {};")
    page.goto(file.as_uri())
    expect(page.locator("body")).to_have_attribute("data-ready", "")
    expect(page.locator("#play")).to_have_attribute("aria-label", "Pause (Space)")
    expect(page.locator("#play path")).not_to_have_attribute("d", "")


def test_a_part_counts_on_the_clock_of_the_performance(page: Page, tmp_path: Path) -> None:
    file, poses = tmp_path / "part.html", random_poses(np.random.default_rng(1), seconds=2.0)
    file.write_bytes(replay_page(poses, title="Walk", start_s=0.5, end_s=1.5))
    page.goto(file.as_uri())
    expect(page.locator("body")).to_have_attribute("data-ready", "")
    page.keyboard.press("Space")
    page.keyboard.press("Home")
    expect(page.locator("#time")).to_have_text("0:00.50 / 0:01.50")
    expect(page.locator("#time")).to_have_attribute("title", "Time since the performance began")


def test_a_paused_replay_rests_until_there_is_another_picture(page: Page, tmp_path: Path) -> None:
    file = tmp_path / "walk.html"
    file.write_bytes(replay_page(random_poses(np.random.default_rng(1), seconds=1.0), title="Walk"))
    page.goto(file.as_uri())
    expect(page.locator("body")).to_have_attribute("data-ready", "")
    page.keyboard.press("f")  # a view that follows arrives seconds later
    page.keyboard.press("Home")
    for change in (
        lambda: page.keyboard.press("End"),
        lambda: page.set_viewport_size({"width": 390, "height": 844}),
        lambda: page.evaluate(LOSES_ITS_PICTURES),
    ):
        until(lambda: page.evaluate(RESTS))
        drawn = int(page.locator("body").get_attribute("data-drawn") or 0)
        change()
        expect(page.locator("body")).not_to_have_attribute("data-drawn", str(drawn))


def test_a_link_opens_the_replay_and_reaches_nothing_else(page: Page, tmp_path: Path) -> None:
    take_with_solves(tmp_path / "monday" / "one")
    with studio(tmp_path) as (app, _), serving(app) as url:
        share = patient.post(f"{url}/api/v1/takes/monday/one/solves/studio/share", timeout=60).json()
        page.goto(url + share["path"])
        expect(page.locator("body")).to_have_attribute("data-drawn", re.compile(r"\d"))
        assert page.evaluate("self.origin") == "null"


def test_a_script_in_the_page_cannot_ask_the_studio(chromium, tmp_path: Path) -> None:
    take_with_solves(tmp_path / "monday" / "one")
    page = chromium.new_page()  # what is refused is logged
    with studio(tmp_path) as (app, _), serving(app) as url:
        share = patient.post(f"{url}/api/v1/takes/monday/one/solves/studio/share", timeout=60).json()
        page.goto(url + share["path"])
        expect(page.locator("body")).to_have_attribute("data-ready", "")
        asked = "fetch('/api/v1/takes').then((answer) => answer.status, () => 'refused')"
        assert page.evaluate(asked) == "refused"
    page.close()
