"""A whole shoot as a new user does it, by the clock: the first command, the page, and a file of another program.

The user knows only what the page shows, and presses what it offers next. A person reads for a while before
each step. The times of all steps are printed; the bar is three minutes.
"""

import re
import time
from pathlib import Path

import pytest
from playwright.sync_api import Browser, Page, expect

from studio.engine.model.poses import Poses
from tests.acceptance.program import studio_program
from tests.acceptance.test_first_light_browser import check_human
from tests.engine.animation.export.readers.programs import read_with_ufbx
from tests.engine.animation.export.scoring import position_error_cm
from tests.web.browser import SELDOM_MS, quiet_page, views_that_are

BAR_S = 180.0
READING_MS = 2000
PERFORMANCE_MS = 10_000
PATIENCE_MS = 600_000
"""How long a step is waited for: the clock is read at the end."""


class Clock:
    """What a shoot has taken so far, step by step."""

    def __init__(self) -> None:
        self._began_s = time.monotonic()
        self.steps: list[tuple[str, float]] = []

    def done(self, step: str) -> None:
        self.steps.append((step, time.monotonic() - self._began_s))

    def told(self) -> str:
        return "\n".join(f"{seconds:6.1f} s  {step}" for step, seconds in self.steps)


def shoot(page: Page, clock: Clock, file: Path) -> None:
    """From the opened page to the downloaded FBX."""
    expect(page.locator("#cameras .camera")).to_have_count(2, timeout=PATIENCE_MS)
    clock.done("two cameras are in the list")
    badge = page.locator("#calibration-badge")
    expect(badge).to_have_text(re.compile("calibrating|good|usable"), timeout=PATIENCE_MS)
    clock.done("the calibration has begun by itself")
    expect(badge).to_have_text(re.compile("good|usable"), timeout=PATIENCE_MS)
    clock.done("calibrated")
    page.wait_for_timeout(READING_MS)
    page.locator("#guide").get_by_role("button", name="Record").click()
    expect(page.locator("#record .label")).to_have_text("Stop")
    clock.done("recording")
    page.wait_for_timeout(PERFORMANCE_MS)
    page.locator("#record").click()
    export = page.locator(".take").get_by_role("button", name="Export")
    expect(export).to_be_visible(timeout=PATIENCE_MS)
    clock.done("the take is in the list")
    page.wait_for_timeout(READING_MS)
    page.locator(".take-picture").click()
    expect(page.locator("#replay-time")).to_be_visible()
    page.wait_for_timeout(READING_MS)
    clock.done("looked at")
    export.click()
    page.wait_for_timeout(READING_MS)
    with page.expect_download(timeout=PATIENCE_MS) as download:
        page.locator("#export-run").click()
    download.value.save_as(file)
    clock.done("the FBX is downloaded")


@pytest.mark.long
@pytest.mark.browser
@pytest.mark.timeout(1800)
def test_a_whole_shoot_within_three_minutes(tmp_path: Path, chromium: Browser) -> None:
    sessions = tmp_path / "sessions"
    sessions.mkdir()
    clock = Clock()
    program = studio_program(sessions, words=())  # as `./start` runs it
    views = views_that_are("drawn", interval_ms=SELDOM_MS)
    with views, program as host, quiet_page(chromium) as page:
        clock.done("the program answers")
        page.goto(f"http://{host}")
        expect(page.locator("#connection")).to_have_text("Connected", timeout=PATIENCE_MS)
        clock.done("the page is there")
        shoot(page, clock, tmp_path / "take.fbx")
    print(clock.told())
    (poses,) = sessions.glob("*/*/solves/live/poses.npz")
    live = Poses.load(poses)
    check_human(live)
    exported = read_with_ufbx(tmp_path / "take.fbx", hz=live.frames_per_second)
    assert position_error_cm(exported, live).max() < 0.1
    assert clock.steps[-1][1] < BAR_S, clock.told()
