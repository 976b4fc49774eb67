"""Elements are replaced only where they differ, and not while the pointer is pressed on them."""

from pathlib import Path

import pytest
from playwright.sync_api import Page, expect

from tests.web.stages import serving
from tests.web.test_page import open_page, studio

pytestmark = pytest.mark.browser

BUTTON = """async () => {
  const { h, redraw } = await import(new URL("static/base/dom.js", document.baseURI));
  const box = h("div", { id: "box", style: "position: fixed; inset: 0; z-index: 99" });
  document.body.append(box);
  window.clicked = [];
  const click = (number) => () => window.clicked.push(number);
  const button = (number) => h("button", { type: "button", onclick: click(number) }, `number ${number}`);
  window.show = (number) => redraw(box, number, () => button(number));
  window.show(1);
}"""


def test_a_click_counts_though_what_was_clicked_changes_meanwhile(tmp_path: Path, page: Page) -> None:
    with studio(tmp_path) as (app, _), serving(app) as url:
        open_page(page, url)
        page.evaluate(BUTTON)
        page.locator("#box button").hover()
        page.mouse.down()
        page.evaluate("window.show(2), window.show(3)")
        expect(page.locator("#box")).to_have_text("number 1")
        page.mouse.up()
        expect(page.locator("#box")).to_have_text("number 3")
        assert page.evaluate("window.clicked") == [1]
        page.evaluate("window.show(4)")
        expect(page.locator("#box")).to_have_text("number 4")
        page.close()  # before the server, whose end it would complain of
