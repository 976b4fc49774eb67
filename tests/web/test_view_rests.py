"""The 3D view draws while something changes, with fewer pixels where it draws by software, and rests otherwise."""

import pytest
from playwright.sync_api import Page

from studio.web.scene import drawing
from tests.web.browser import until
from tests.web.stages import FakeStage, step

pytestmark = [pytest.mark.browser, pytest.mark.moving]

DRAWN = "(window.__viserMutable?.scene?.__r3f.root.getState().gl.info.render.frame ?? 0)"
WIDTH = "document.querySelector('canvas[data-engine]').width"
CORNERS = """(() => {
  let corners = 0;
  window.__viserMutable?.scene?.traverseVisible((one) => {
    if (one.isSkinnedMesh) corners += one.geometry.index.count;
  });
  return corners;
})()"""
ROOM = "window.__viserMutable.scene.environment"
"""The image of a room that lights bodies. Software takes seconds to filter one before the first picture of a body."""
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


def test_software_draws_bodies_of_fewer_triangles_while_something_moves(
    stage: FakeStage, address: str, page: Page
) -> None:
    page.goto(f"{address}/viewer/?software")
    page.locator("canvas[data-engine]").wait_for()
    with stage.performing():
        until(page, f"{WIDTH} < 0.7 * innerWidth * devicePixelRatio")
        until(page, f"{CORNERS} > 0")
        assert page.evaluate(ROOM) is None
        moving, at_rest = page.evaluate(f"""() => {{
          const moving = {CORNERS}, {{ scene, camera }} = window.__viserMutable;
          drawCoarsely(scene, camera, false);
          return [moving, {CORNERS}];
        }}""")
        assert 0 < moving < at_rest / 2
        until(page, f"{CORNERS} === {moving}")


def test_software_begins_a_picture_once_the_last_one_is_there(
    stage: FakeStage, address: str, page: Page
) -> None:
    page.add_init_script("""
        const { getSyncParameter, UNSIGNALED } = WebGL2RenderingContext.prototype;
        WebGL2RenderingContext.prototype.getSyncParameter = function (...how) {
          if (!window.held) return getSyncParameter.apply(this, how);
          window.asked = (window.asked ?? 0) + 1;
          return UNSIGNALED;
        };
    """)
    page.goto(f"{address}/viewer/?software")
    page.locator("canvas[data-engine]").wait_for()
    with stage.performing():
        until(page, f"{WIDTH} < 0.6 * innerWidth * devicePixelRatio")  # another resolution is drawn at once
        page.evaluate("window.held = true")
        until(page, "window.asked > 0")
        drawn = page.evaluate(DRAWN)
        until(page, "window.asked > 10")
        assert page.evaluate(DRAWN) == drawn
        page.evaluate("window.held = false")
        until(page, f"{DRAWN} > {drawn}")
