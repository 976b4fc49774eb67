"""Help: topics and keys in one dialog, found by words; the T-pose is shown while it is counted down."""

import pytest
from playwright.sync_api import Page, expect

from tests.web.test_page import empty, live, open_page

__all__ = ["empty", "live"]


@pytest.mark.parametrize(
    ("language", "typed", "topic"),
    [
        ("en", "own CHARACTER", "Put the motion on your own character"),
        ("fr", "camera bouge", "La figure n'est pas"),
    ],
)
def test_the_guide_is_searched(empty: str, page: Page, language: str, typed: str, topic: str) -> None:
    page.add_init_script(f"localStorage.setItem('language', '{language}')")
    page.goto(empty)
    expect(page.locator("#preset")).to_be_visible()
    page.keyboard.press("?")
    help_dialog = page.locator("#help")
    expect(page.locator("#help-search")).to_be_focused()
    assert help_dialog.locator(".topic").count() > 12
    page.keyboard.type(typed)
    expect(help_dialog.locator(".topic:not([hidden])").filter(has_text=topic)).to_be_visible()
    page.fill("#help-search", "loop" if language == "en" else "boucle")
    expect(help_dialog.locator(".shortcuts dt:not([hidden])")).to_have_count(1)
    page.fill("#help-search", "xyzzy")
    expect(help_dialog.locator(".empty")).to_contain_text("xyzzy")
    page.keyboard.press("Escape")  # empties the field
    page.keyboard.press("Escape")
    expect(help_dialog).to_be_hidden()


def test_a_topic_shows_its_control(empty: str, page: Page) -> None:
    open_page(page, empty)
    page.locator("#help-button").click()
    page.fill("#help-search", "palms")
    shown = page.locator("#help .topic:not([hidden])")
    expect(shown).to_have_count(1)
    shown.get_by_role("button", name="Show me").click()
    expect(page.locator("#help")).to_be_hidden()
    expect(page.locator("#performer-title-fold")).to_be_focused()


def test_the_pose_is_shown_while_it_is_counted_down(live: str, page: Page) -> None:
    open_page(page, live)
    picture = page.get_by_role("img", name="arms level to both sides")
    expect(picture).to_be_hidden()
    expect(page.locator("#tpose")).to_be_enabled()
    page.keyboard.press("t")
    expect(picture).to_be_visible()
