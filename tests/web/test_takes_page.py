"""The list of takes on the page: search, pages, and what is done with several at once."""

import re
from collections.abc import Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Page, Route, expect

from studio.take.folder.take import Take
from studio.take.library.index import AT_ONCE
from tests import patient
from tests.web.browser import until, wait_for_undos
from tests.web.playback.takes import take_with_solves
from tests.web.stages import serving
from tests.web.test_page import SIZES, open_page, studio

pytestmark = pytest.mark.browser
MANY = 200


@pytest.fixture
def address(tmp_path: Path) -> Iterator[str]:
    """A studio with two solved takes and many that have nothing but a name."""
    for seed, name in enumerate(("one", "two")):
        take = take_with_solves(tmp_path / "monday" / name, seed=seed)
        take.meta["created"] = f"2026-03-0{seed + 1}T12:00:00+00:00"
        take.save_meta()
    for k in range(MANY):
        made = f"2026-02-01T{k // 60:02d}:{k % 60:02d}:00+00:00"
        told = {"performer": ("Anna", "Ben")[k % 2], "notes": f"scene {k}", "created": made}
        path = tmp_path / "tuesday" / f"take_{k:03d}"
        take = Take.create(path, session="tuesday", name=path.name, source="import", **told)
        take.meta["recording"] = "done"
        take.save_meta()
    with studio(tmp_path) as (app, _), serving(app) as url:
        yield url


def test_numbers_of_takes_that_are_still_read_are_in_the_page_s_language(address: str, page: Page) -> None:
    def partly_read(route: Route) -> None:
        answer = route.fetch()
        route.fulfill(response=answer, headers={**answer.headers, "x-takes-read": "1200/12000"})

    page.add_init_script("localStorage.setItem('language', 'fr')")
    page.route("**/takes?search=*", partly_read)
    page.goto(address)
    expect(page.locator("#takes-reading")).to_contain_text(re.compile(r"1\s200\D+12\s000"))


def search(page: Page, text: str) -> None:
    page.get_by_label("Search takes").fill(text)


def names(page: Page) -> list[str]:
    return page.locator("#takes-list .take-head .name").all_text_contents()


def test_a_click_counts_though_its_row_changes_meanwhile(address: str, page: Page) -> None:
    open_page(page, address)
    star = page.get_by_role("button", name="Star one")
    star.hover()
    page.mouse.down()
    takes = f"{address}/api/v1/takes"
    patient.patch(f"{takes}/monday/one", json={"notes": "changed meanwhile"}).raise_for_status()
    patient.delete(f"{takes}/tuesday/take_000").raise_for_status()
    expect(page.locator("#takes-count")).to_have_text(f"{MANY + 1} takes")  # the page knows of both
    row = page.locator("#takes-list .take", has=star)
    expect(row).not_to_contain_text("changed meanwhile")
    page.mouse.up()
    expect(row).to_contain_text("changed meanwhile")
    expect(star).to_have_attribute("aria-pressed", "true")


NOTED = """window.said = []; window.listed = [];
  const note = () => {
    for (const id of ["takes-reading", "takes-empty"]) {
      const line = document.getElementById(id);
      if (line && !line.hidden && !window.said.includes(line.textContent)) window.said.push(line.textContent);
    }
    const count = document.querySelectorAll("#takes-list .take").length;
    if (window.listed.at(-1) !== count) window.listed.push(count);
  };
  new MutationObserver(note).observe(
    document, { childList: true, subtree: true, attributes: true, characterData: true });
"""
"""Notes what the page says of takes that are still read, and how many it lists."""


def test_many_takes_are_listed_at_once_by_pages_and_found_by_fields(address: str, page: Page) -> None:
    page.add_init_script(NOTED)
    open_page(page, address)
    expect(page.locator("#takes-count")).to_have_text(
        f"{MANY + 2} takes"
    )  # how many there are is known at once
    assert f"Reading takes: {AT_ONCE} of {MANY + 2}." in page.evaluate("window.said.join()")
    expect(page.locator("#takes-reading")).to_be_hidden()
    search(page, "scene")
    expect(page.locator("#takes-count")).to_have_text(f"{MANY} of {MANY + 2}")
    assert "No takes yet" not in page.evaluate("window.said.join()")
    assert next(count for count in page.evaluate("window.listed") if count) == AT_ONCE
    search(page, "")
    expect(page.locator("#takes-count")).to_have_text(f"{MANY + 2} takes")
    expect(page.locator("#takes-list .take .name").first).to_have_text("two")
    assert names(page)[:3] == ["two", "one", "take_199"]
    assert page.locator("#takes-list .take").count() < MANY
    expect(page.locator("#takes-more")).to_contain_text(f"of {MANY + 2})")
    until(  # whoever scrolls down sees them all
        page,
        "() => { document.querySelector('#takes-more').scrollIntoView();"
        f" return document.querySelectorAll('#takes-list .take').length === {MANY + 2}; }}",
    )
    expect(page.locator("#takes-more")).to_be_hidden()
    assert len(set(names(page))) == MANY + 2
    search(page, "performer:anna scene -note:199 date:2026-02")
    expect(page.locator("#takes-count")).to_have_text(f"100 of {MANY + 2}")
    search(page, "colour:red")
    expect(page.locator("#takes-problem")).to_contain_text("'colour' is not known; allowed: name")
    expect(page.locator("#takes-count")).to_have_text(f"{MANY + 2} takes")
    search(page, "nobody")
    expect(page.locator("#takes")).to_contain_text("No take has these words")
    page.locator("#takes-help summary").click()
    page.get_by_role("button", name="is:starred").click()
    expect(page.get_by_label("Search takes")).to_have_value("is:starred")
    search(page, "is:solved")
    expect(page.locator("#takes-list .take")).to_have_count(2)
    page.reload()
    expect(page.get_by_label("Search takes")).to_have_value("is:solved")
    expect(page.locator("#takes-list .take")).to_have_count(2)


def test_several_takes_are_tagged_compared_and_thrown_away(address: str, page: Page) -> None:
    open_page(page, address)
    page.get_by_label("Select one").check()
    expect(page.locator("#selected-compare")).to_be_disabled()
    page.get_by_label("Select two").check()
    expect(page.locator(".selected-count")).to_contain_text("2 takes selected")
    page.locator("#selected-tag").click()
    page.get_by_label("Tags").fill("best, Kick")
    page.get_by_role("button", name="Save", exact=True).click()
    expect(page.locator(".tags .chip-button")).to_have_count(4)
    page.locator(".tags .chip-button", has_text="Kick").first.click()
    expect(page.locator("#takes-list .take")).to_have_count(2)
    page.locator("#selected-compare").click()
    expect(page.locator("#compare")).to_be_visible()
    expect(page.locator("#compare-b")).to_have_value("monday/two|studio")
    expect(page.locator("#compare-figures table")).to_contain_text("two")  # both are loaded and measured
    page.locator("#compare-close").click()
    page.locator("#selected-splice").click()
    page.get_by_label("To [s], one", exact=True).fill("1.2")
    page.locator("#splice-blend").fill("0.3")
    page.get_by_role("dialog").get_by_role("button", name="Splice", exact=True).click()
    expect(page.get_by_text("one_spliced is spliced")).to_be_visible()
    page.locator("#selected-trash").click()
    expect(page.locator("#takes-empty")).to_be_visible()
    expect(page.locator("#takes-selected button")).to_have_count(0)
    wait_for_undos(page, 2)
    page.locator("h1").click()
    page.keyboard.press("Control+z")
    expect(page.locator("#takes-list .take")).to_have_count(2)
    page.keyboard.press("Control+z")
    expect(page.locator("#takes-empty")).to_be_visible()  # nothing has the tag any longer


def test_the_tools_of_the_list_fit(address: str, page: Page) -> None:
    open_page(page, address)
    page.get_by_label("Select one").check()
    page.locator("#takes-help summary").click()
    for width, height in SIZES:
        page.set_viewport_size({"width": width, "height": height})
        too_wide = page.evaluate(
            "() => [...document.querySelectorAll('#takes-find *, #takes-selected *, #takes-list *')]"
            ".filter((e) => e.getBoundingClientRect().right > innerWidth + 1).map((e) => e.outerHTML)"
        )
        assert too_wide == [], width
