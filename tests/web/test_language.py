"""Another language is shown at once, in place: nothing is reloaded, and what is open or typed stays."""

from collections.abc import Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Page, expect

from tests.web.browser import until
from tests.web.playback.takes import take_with_solves
from tests.web.stages import serving
from tests.web.test_page import open_page, studio
from tests.web.test_strings import parts

pytestmark = pytest.mark.browser

WORDS = """() => {
  const seen = (e) => e.checkVisibility();
  const found = [];
  const walker = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
  for (let node = walker.nextNode(); node; node = walker.nextNode()) {
    if (seen(node.parentElement)) found.push(node.data.trim());
  }
  for (const e of document.querySelectorAll("body *")) {
    if (!seen(e)) continue;
    for (const name of ["title", "aria-label", "placeholder", "alt"]) found.push(e.getAttribute(name) ?? "");
  }
  return [...new Set(found.map((text) => text.replaceAll("\u00a0", " ")).filter(Boolean))];
}"""
"""All words of what is seen: texts, and what is said of controls."""

CHOOSE = """(language) => {
  const choice = document.querySelector("#language");
  choice.value = language;
  choice.dispatchEvent(new Event("change"));
}"""
"""Changes the language, also while a dialog lies over the choice."""


@pytest.fixture
def takes(tmp_path: Path) -> Iterator[str]:
    """Address of a studio with two takes and no camera."""
    for seed, name in enumerate(("one", "two")):
        take_with_solves(tmp_path / "monday" / name, seed=seed)
    with studio(tmp_path) as (app, _), serving(app) as url:
        yield url


def only(language: str) -> set[str]:
    """Texts of the page that are of one language alone, without those with values or a plural."""
    column = ("en", "fr").index(language)
    others = {texts[1 - column] for texts in parts().values()}
    whole = {
        text for texts in parts().values() if (text := texts[column]) and "{" not in text and "|" not in text
    }
    return whole - others


def assert_in(page: Page, language: str) -> None:
    """Nothing that is seen is in the other language, and much is in this one."""
    other = "en" if language == "fr" else "fr"
    until(page, f"document.documentElement.lang === '{language}'")
    seen = set(page.evaluate(WORDS))
    assert seen & only(other) == set()
    assert len(seen & only(language)) > 30
    for key, text in page.locator("[data-t]:not(:has(*))").evaluate_all(
        "all => all.filter((e) => e.checkVisibility()).map((e) => [e.dataset.t, e.textContent])"
    ):
        assert text.replace("\u00a0", " ") not in only(other), key


def test_the_language_changes_in_place(takes: str, page: Page) -> None:
    open_page(page, takes)
    loads: list[str] = []
    page.on("framenavigated", lambda frame: loads.append(frame.url))
    page.locator(".take[data-take='monday/one'] .take-picture").click()
    expect(page.locator("#timeline")).to_be_visible()
    page.keyboard.press("Home")
    for _ in range(7):
        page.keyboard.press("ArrowRight")
    expect(page.locator("#replay-time")).to_contain_text("  7 / ")
    two = page.locator(".take[data-take='monday/two']")
    two.get_by_role("button", name="Edit two").click()
    page.fill("#slate-notes", "half a sentence,\nCameras")
    page.fill("#take-name", "next one")
    page.locator("#view-layers summary").click()
    for language in ("fr", "en", "fr"):
        drawn = page.locator("#timeline").evaluate("canvas => canvas.toDataURL()")
        page.get_by_label("Language" if language == "fr" else "Langue").select_option(language)
        assert_in(page, language)
        assert page.locator("#timeline").evaluate("canvas => canvas.toDataURL()") != drawn, "its labels"
        expect(page.locator("#replay-time")).to_contain_text("  7 / ")
        expect(page.locator("#slate-notes")).to_have_value("half a sentence,\nCameras")
        expect(page.locator("#take-name")).to_have_value("next one")
        expect(page.locator("#replay-title")).to_contain_text("monday/one")
    expect(two.locator("form.slate button[type=submit]")).to_have_text("Enregistrer")
    expect(page.locator("#view-places")).to_contain_text("Plateau")
    two.locator("form.slate button[type=submit]").click()
    expect(two.locator(".notes summary")).to_have_text("half a sentence,")
    assert page.request.get(f"{takes}/api/v1/takes/monday/two").json()["notes"] == "half a sentence,\nCameras"
    assert loads == [], "the page was loaded anew"
    page.reload()
    expect(page.locator("#connection")).to_have_text("Connecté")


def test_dialogs_stay_open_with_what_was_typed(takes: str, page: Page) -> None:
    open_page(page, takes)
    page.evaluate("window.same = true")
    for opened in ("export", "help", "trash", "import"):
        if opened == "export":
            page.locator(".take[data-take='monday/one']").get_by_role("button", name="Export").first.click()
            page.fill("#export-start_s", "0.5")
        elif opened == "help":
            page.locator("#help-button").click()
            page.fill("#help-search", "c")
        else:
            page.locator(f"#{opened}-open").click()
        dialog = page.locator("dialog[open]")
        expect(dialog).to_be_visible()
        page.evaluate(CHOOSE, "fr")
        assert_in(page, "fr")
        expect(dialog).to_be_visible()
        if opened == "export":
            expect(page.locator("#export-start_s")).to_have_value("0.5")
            expect(page.locator("#export-run")).to_have_text("Exporter")
        if opened == "help":
            expect(page.locator("#help-search")).to_have_value("c")
        page.evaluate(CHOOSE, "en")
        assert_in(page, "en")
        page.evaluate("document.querySelector('dialog[open]').close()")
        expect(dialog).to_have_count(0)
    assert page.evaluate("window.same")
