"""Several performers in the replay of the page: curves of one, exchanges and names, exports apart or together."""

from collections.abc import Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Page, expect

from studio.take.folder.take import Take
from tests import patient
from tests.web.playback.takes import take_of_two
from tests.web.stages import until
from tests.web.test_page import serving, studio

pytestmark = pytest.mark.browser


@pytest.fixture
def address(tmp_path: Path) -> Iterator[str]:
    """Address of a studio with a take of two performers."""
    take_of_two(tmp_path / "monday" / "fight")
    with studio(tmp_path) as (app, _), serving(app) as url:
        yield url


ROWS = """[...document.querySelectorAll("#replay-bar .replay-row")].map((row) => new Set(
  [...row.querySelectorAll("button, select")].map((one) => Math.round(one.getBoundingClientRect().top))).size)"""
"""In how many lines the buttons of each row of the replay's bar stand."""


def test_all_performers_are_measured_at_once(address: str, page: Page, tmp_path: Path) -> None:
    take = f"{address}/api/v1/takes/monday/fight"
    solve = tmp_path / "monday/fight/solves/studio"
    for performer in ("performer_1", "performer_2"):
        file = (solve / performer / "poses.npz").read_bytes()
        patient.put(f"{take}/references/{performer}.npz", content=file).raise_for_status()
        how = {"solve": "studio", "align_time": False, "performer": performer}
        patient.post(f"{take}/references/{performer}.npz/align", json=how).raise_for_status()
    page.goto(address)
    page.get_by_role("button", name="Replay fight, solve studio").click()
    page.set_viewport_size({"width": 1280, "height": 800})
    expect(page.locator("#replay-performer")).to_be_visible()
    assert page.evaluate(ROWS) == [1, 1]
    page.locator("#replay-compare").click()
    page.locator("#compare-together").click()
    table = page.locator("#compare-people")
    expect(table.get_by_role("row", name="Performer 1")).to_contain_text("0.0")
    expect(table.get_by_role("row", name="Performer 2")).to_contain_text("0.0")
    expect(table.get_by_role("row", name="Became another one")).to_contain_text("0")
    expect(table.get_by_role("row", name="Frames missed")).to_contain_text("0.0 %")


def test_two_are_replayed_exchanged_named_and_exported(address: str, page: Page, tmp_path: Path) -> None:
    def meta() -> dict:
        return dict(Take.open(tmp_path / "monday" / "fight").meta)

    page.goto(address)
    page.get_by_role("button", name="Replay fight, solve studio").click()
    page.locator("#replay-performer").select_option(label="Performer 2")
    until(lambda: patient.get(f"{address}/api/v1/replay").json()["performer"] == "performer_2")
    page.locator("#timeline").press("End")
    page.locator("#replay-exchange").click()
    until(lambda: len(meta().get("exchanges", [])) == 1)
    assert meta()["exchanges"][0]["performers"] == ["performer_1", "performer_2"]
    page.locator("#replay-performers").click()
    expect(page.locator("#performers-solve")).to_be_visible()
    page.locator("#undo").click()
    until(lambda: meta()["exchanges"] == [])
    expect(page.locator("#performers-solve")).to_have_count(0)
    page.locator("#name-performer_2").fill("Ana")
    page.locator("#name-performer_2").press("Enter")
    until(lambda: meta().get("performer_names") == {"performer_2": "Ana"})
    expect(page.locator("#replay-performer")).to_contain_text("Ana")
    page.locator("#open-take").get_by_role("button", name="Export").click()
    choice = page.locator("#export-performer")
    expect(choice.locator("option")).to_have_text(["Each in a file", "All in one file", "Performer 1", "Ana"])
    choice.select_option("together")
    page.locator("#export-format").select_option("bvh")
    expect(choice).to_have_value("")  # a BVH holds one
