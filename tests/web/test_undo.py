"""Undo on the page: the button says what it takes back, switches and presets too."""

from playwright.sync_api import Browser, Page, expect

from tests.web.test_page import empty, open_page

__all__ = ["empty"]


def choose(page: Page, switch: str, value: str) -> None:
    page.evaluate("document.querySelector('#switches').open = true")
    page.locator(f"#switch-{switch}").select_option(value)


def test_the_button_says_what_it_takes_back(empty: str, page: Page) -> None:
    open_page(page, empty)
    undo = page.locator("#undo")
    expect(undo).to_be_disabled()
    expect(undo).to_have_attribute("title", "Nothing to undo")
    fusion = page.locator("#switch-fusion")
    page.evaluate("document.querySelector('#switches').open = true")
    before = fusion.input_value()
    values = fusion.locator("option").evaluate_all("all => all.map(one => one.value)")
    other = next(value for value in values if value != before)
    choose(page, "fusion", other)
    expect(undo).to_be_enabled()
    assert "Undo (Ctrl+Z): Fusion" in (undo.get_attribute("title") or "")
    page.locator("#preset").select_option("thesis")  # puts the switch back: one act, with a note
    expect(undo).to_have_attribute("title", "Undo (Ctrl+Z): 1 switch put back to Thesis")
    undo.click()
    expect(fusion).to_have_value(other)
    expect(page.locator("#messages")).to_contain_text("Undone: 1 switch put back to Thesis")
    undo.click()
    expect(fusion).to_have_value(before)
    expect(undo).to_be_disabled()


def test_a_switch_that_is_refused_leaves_nothing_to_undo(empty: str, chromium: Browser) -> None:
    page = chromium.new_page()  # a refusal is logged by the browser itself
    open_page(page, empty)
    page.evaluate("document.querySelector('#switches').open = true")
    page.fill("#switch-look_at_point_m", "over there")
    page.keyboard.press("Enter")
    expect(page.locator("#messages [role=alert]")).to_be_visible()
    expect(page.locator("#undo")).to_be_disabled()
    page.close()
