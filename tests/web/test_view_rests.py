"""The 3D view draws while something changes, with fewer pixels where it draws by software, and rests otherwise."""

import pytest
from playwright.sync_api import Page

from studio.web.scene import drawing
from tests.web.browser import until
from tests.web.stages import FakeStage, step

pytestmark = [pytest.mark.browser, pytest.mark.moving]

DRAWN = "(window.__viserMutable?.scene?.__r3f.root.getState().gl.info.render.frame ?? 0)"
WIDTH = "document.querySelector('canvas[data-engine]').width"
AT_REST = f"""() => {{
  const before = {DRAWN};
  return new Promise((tell) => setTimeout(() => tell(before > 0 && before === {DRAWN}), 2500));
}}"""
"""Whether nothing is drawn while the server's beat comes many times."""


def test_the_view_rests_until_something_changes(
    monkeypatch: pytest.MonkeyPatch, stage: FakeStage, address: str, page: Page
) -> None:
    monkeypatch.setattr(drawing, "BEAT_S", 0.1)
    page.goto(f"{address}/viewer/")
    page.locator("canvas[data-engine]").wait_for()
    until(page, AT_REST)
    drawn = page.evaluate(DRAWN)
    stage.callbacks[0](step(0.1))
    until(page, f"{DRAWN} > {drawn}")
    until(page, AT_REST)


def test_software_draws_fewer_pixels_while_something_moves(
    stage: FakeStage, address: str, page: Page
) -> None:
    page.goto(f"{address}/viewer/?software")
    page.locator("canvas[data-engine]").wait_for()
    with stage.performing():
        until(page, f"{WIDTH} < innerWidth * devicePixelRatio")
    until(page, f"{WIDTH} > innerWidth * devicePixelRatio")
