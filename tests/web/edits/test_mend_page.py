"""From what is to mend to the export, and another pace and a loop of a range: by the page alone."""

import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from playwright.sync_api import Locator, Page, expect

from studio.engine.model.joints import OUTPUT_INDEX
from studio.engine.model.poses import Poses
from studio.take.edits.kept import read_edits
from studio.take.folder.take import Take
from tests.web.edits.test_edits_page import address as address
from tests.web.edits.test_edits_page import edits, opened, solved_with
from tests.web.edits.test_edits_page import take as take
from tests.web.stages import until

pytestmark = pytest.mark.browser
MOST_CLICKS = 6
WHETHER_IT_DID = re.compile("Gone|Still there")
FEET = [OUTPUT_INDEX[name] for name in ("LeftFoot", "RightFoot")]


@pytest.fixture
def click() -> Callable[[Locator], int]:
    """Clicks, and says which click of the test it was."""
    made = []

    def clicked(where: Locator) -> int:
        where.click()
        made.append(where)
        return len(made)

    return clicked


def poses(take: Take, solve: str) -> Poses:
    return Poses.load(take.solve_folder(solve) / "poses.npz")


def test_an_event_is_mended_and_exported(
    address: str, take: Take, page: Page, click: Callable[[Locator], int]
) -> None:
    opened(page, address)
    click(page.locator("#edit-offers"))
    rows = page.locator("#offer-list > li")
    expect(rows).to_have_count(2)
    expect(rows.first).to_contain_text("left toe")
    click(rows.first.locator(".edit-go"))
    expect(page.locator("#replay-time")).not_to_contain_text(" 60 /")
    click(rows.first.get_by_role("button", name="Apply"))
    (contact,) = edits(take, 1).edits
    assert (contact.joint, contact.touches) == ("left_toe", "floor")
    until(lambda: solved_with(take) == 1)
    expect(page.locator("#offer-list .good, #offer-list .fair")).to_have_count(1)
    expect(page.locator("#offer-list")).to_contain_text(WHETHER_IT_DID)
    click(page.get_by_role("button", name="Export walk, solve studio").first)
    with page.expect_download(timeout=120_000) as download:
        assert click(page.locator("#export-run")) <= MOST_CLICKS
    assert Path(download.value.path()).stat().st_size > 10_000


def test_a_range_goes_slower_and_comes_again_and_again(address: str, take: Take, page: Page) -> None:
    before = poses(take, "studio")
    opened(page, address)

    def choose(kind: str) -> None:
        page.evaluate("document.querySelector('#edit-range').open = true")
        page.locator("#edit-kind").select_option(kind)
        page.fill("#edit-from", "0.5")
        page.fill("#edit-to", "2.5")

    choose("contact_floor")
    page.locator("#edit-loop").click()
    page.fill("#splice-blend", "0.4")
    page.get_by_role("dialog").get_by_role("button", name="Loop").click()
    loop = take.path.parent / "walk_loop"
    until(lambda: (loop / "solves" / "spliced" / "metrics.json").is_file())
    again = poses(Take.open(loop), "spliced")
    assert again.time_s[-1] - again.time_s[0] == pytest.approx(7.0, abs=2.0)  # four times, blended
    step, usual = (np.linalg.norm(np.diff(one.positions_m, axis=0), axis=2).max() for one in (again, before))
    assert step < 2.0 * usual  # no seam is seen

    choose("retime")
    page.fill("#edit-factor", "2")
    page.locator("#edit-add").click()
    edits(take, 1)
    until(lambda: solved_with(take) == read_edits(take).revision)
    slower = poses(take, "studio")
    assert slower.time_s[-1] - slower.time_s[0] == pytest.approx(
        before.time_s[-1] - before.time_s[0] + 2.0, abs=0.4
    )
    away = np.linalg.norm(slower.positions_m[:, FEET] - before.positions_m[0, FEET], axis=2)
    was = np.linalg.norm(before.positions_m[:, FEET] - before.positions_m[0, FEET], axis=2)
    assert away.max() < was.max() + 0.01  # feet keep their places
