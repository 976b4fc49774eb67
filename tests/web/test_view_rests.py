"""The 3D view draws while something changes, and rests otherwise."""

import pytest
from playwright.sync_api import Page

from studio.web.scene import drawing
from tests.web.browser import until
from tests.web.stages import FakeStage, step

pytestmark = pytest.mark.browser

COUNT = """() => {
  window.drawn = 0;
  const count = () => { window.drawn += 1; requestAnimationFrame(count); };
  count();
}"""
AT_REST = """() => {
  const before = window.drawn;
  return new Promise((tell) => setTimeout(() => tell(before === window.drawn), 1000));
}"""


def test_the_view_rests_until_something_changes(
    monkeypatch: pytest.MonkeyPatch, stage: FakeStage, address: str, page: Page
) -> None:
    monkeypatch.setattr(drawing, "BEAT_S", float("inf"))  # else a frame is drawn at every beat
    page.goto(f"{address}/viewer/")
    page.locator("canvas[data-engine]").wait_for()
    page.evaluate(COUNT)
    for change in (lambda: page.mouse.move(300, 300), lambda: stage.callbacks[0](step(0.1))):
        until(page, AT_REST)
        drawn = page.evaluate("window.drawn")
        change()
        until(page, f"window.drawn > {drawn} + 2")
