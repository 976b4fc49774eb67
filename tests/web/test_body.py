"""The choice of a body: each browser shows its own, at once, after a reload, and live."""

import re
from pathlib import Path

import pytest
from playwright.sync_api import Browser, Error, Page, expect

from studio.engine.model.performers.bodies import BODIES
from tests.web.browser import quiet_page
from tests.web.playback.takes import take_with_solves
from tests.web.stages import until
from tests.web.test_page import serving, studio

SCRIPT = Path(__file__).parents[2] / "studio" / "web" / "static" / "view" / "body.js"
LISTEN = """(() => {
  // Keeps which bodies viser's program is told to show, and which of them get bones.
  window.shown = {};
  window.boned = new Set();
  window.Worker = class extends Worker {
    constructor(...how) {
      super(...how);
      setTimeout(() => this.addEventListener("message", ({ data }) => {
        for (const { type, name, visible } of data.type === "message_batch" ? data.messages : []) {
          const body = name?.match(/^\\/character\\/.+\\/bodies\\/(\\w+)(\\/\\d+)?$/);
          if (!body) continue;
          if (type === "SetSceneNodeVisibilityMessage" && !body[2]) window.shown[body[1]] = visible;
          if (type === "SetBonePositionMessage") window.boned.add(body[1]);
        }
      }));
    }
  };
})();"""


def test_the_page_offers_the_servers_bodies() -> None:
    found = re.search(r"BODIES = \[(.*?)\]", SCRIPT.read_text(encoding="utf-8"))
    assert found and re.findall(r"\w+", found[1]) == list(BODIES)


def shows(page: Page, body: str) -> bool:
    """Whether the view shows this body alone, and its bones come."""
    view = page.frame(url=re.compile("/viewer/"))
    try:
        told = view.evaluate("[window.shown, [...window.boned]]") if view else [{}, []]
    except Error:  # the page is being loaded anew
        return False
    return told[0] == {name: name == body for name in BODIES} and body in told[1]


@pytest.mark.browser
@pytest.mark.viewing
def test_each_browser_shows_its_own_body(tmp_path: Path, chromium: Browser, page: Page) -> None:
    take_with_solves(tmp_path / "monday" / "one")
    with studio(tmp_path) as (app, _), serving(app) as url:
        page.add_init_script(LISTEN)
        page.goto(url)
        page.get_by_role("button", name="Replay one, solve studio").click()
        expect(page.locator("#replay-value")).to_contain_text("m")
        until(lambda: shows(page, "standard"))
        page.locator("#view-layers summary").click()
        expect(page.locator("#body-standard")).to_have_attribute("aria-pressed", "true")
        page.locator("#body-blocks").click()
        expect(page.locator("#body-blocks")).to_have_attribute("aria-pressed", "true")
        until(lambda: shows(page, "blocks"))
        page.reload()
        until(lambda: shows(page, "blocks"))
        with quiet_page(chromium) as other:  # a browser of its own
            other.add_init_script(LISTEN)
            other.goto(url)
            until(lambda: shows(other, "standard"))
