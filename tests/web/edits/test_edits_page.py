"""A take is mended on the page: pins by the gizmo, edits over a range, undo, redo, two browsers."""

from collections.abc import Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Browser, Page, expect

from studio.take.edits.kept import TakeEdits, read_edits
from studio.take.folder.solves import read_metrics
from studio.take.folder.take import Take
from tests import patient
from tests.web.browser import quiet_page
from tests.web.edits.takes import solved_take
from tests.web.playback.test_joint_click import pixel
from tests.web.stages import serving, until
from tests.web.test_page import studio

pytestmark = [pytest.mark.browser, pytest.mark.moving]
FRAME = 60
UP_M = 0.15


@pytest.fixture
def take(tmp_path: Path, ready_worker: None) -> Take:
    return solved_take(tmp_path / "monday" / "walk")


@pytest.fixture
def address(take: Take) -> Iterator[str]:
    with studio(take.path.parents[1]) as (app, _), serving(app) as url:
        yield url


def opened(page: Page, url: str) -> Page:
    """The page with the take's solve at a frame, seen from the front."""
    page.goto(url)
    page.get_by_role("button", name="Replay walk, solve studio").click()
    until(lambda: patient.get(f"{url}/api/v1/replay").json()["open"])
    patient.patch(f"{url}/api/v1/replay", json={"frame": FRAME, "playing": False}).raise_for_status()
    expect(page.locator("#replay-time")).to_contain_text(f" {FRAME} /")
    return page


def edits(take: Take, count: int) -> TakeEdits:
    """The take's edits once there are so many."""
    until(lambda: len(read_edits(take).edits) == count)
    return read_edits(take)


def solved_with(take: Take) -> int | None:
    """Which list of edits the take's solve had."""
    return (read_metrics(take.solve_folder("studio")) or {}).get("edits_revision")


def test_a_joint_is_dragged_to_its_place(address: str, take: Take, page: Page) -> None:
    drawn: list[dict] = []
    page.on(
        "request", lambda one: drawn.append(one.post_data_json) if one.url.endswith("/view/pins") else None
    )
    opened(page, address)
    expect(page.frame_locator("#viewer").locator("canvas[data-engine]")).to_be_visible()
    page.locator("#view-front").click()
    joints = f"{address}/api/v1/replay/joints"
    place = patient.get(joints, params={"frame": FRAME}).json()["positions_m"]["LeftHand"]
    page.mouse.click(*pixel(page, place))
    expect(page.locator("#replay-joint")).to_have_value("LeftHand")
    with page.expect_response(lambda one: one.url.endswith("/edits/preview")) as ahead:
        page.keyboard.press("p")
    assert (ahead.value.request.method, ahead.value.status) == ("PUT", 204)  # the first look is expected
    expect(page.locator("#edit-said")).to_have_text("Drag an arrow to where this was: left wrist")
    page.keyboard.press("Escape")
    expect(page.locator("#edit-pin")).to_be_enabled()  # the replay goes on
    page.keyboard.press("p")
    expect(page.locator("#edit-leave")).to_be_visible()
    assert patient.get(f"{address}/api/v1/view/gizmo").json()["place_m"] == pytest.approx(place)

    def dragged() -> bool:
        """Take hold of the arrow and drag it: the view may not have drawn it yet, and is turned then."""
        page.locator("#view-front").click()
        way = [pixel(page, [place[0], place[1], place[2] + 0.22 + UP_M * step / 3]) for step in range(4)]
        page.mouse.move(*way[0])
        page.wait_for_timeout(500)
        page.mouse.down()
        for at in way[1:]:
            page.mouse.move(*at)
            page.wait_for_timeout(250)
        page.mouse.up()
        page.wait_for_timeout(500)
        return page.locator("#edit-list li").count() == 1

    until(dragged)
    (pin,) = edits(take, 1).edits
    assert (pin.joint, pin.performer) == ("left_wrist", "performer_1")
    assert pin.place_m[:2] == pytest.approx(place[:2], abs=0.02)
    assert pin.place_m[2] == pytest.approx(place[2] + UP_M, abs=0.05)
    until(lambda: solved_with(take) == 1)
    kinds = [job["kind"] for job in patient.get(f"{address}/api/v1/jobs").json()]
    assert kinds == ["draft", "solve"]  # the surroundings first
    expect(page.locator("#edit-solve")).to_have_count(0)
    expect(page.locator("#edit-list .found").first).to_contain_text("left wrist, left hand in camera_0")
    now = patient.get(joints, params={"frame": FRAME}).json()["positions_m"]["LeftHand"]
    assert now[2] - place[2] > 0.3 * UP_M
    assert [tuple(one["place_m"]) for one in drawn[-1]["pins"]] == [pin.place_m]


def add_over(page: Page, kind: str, from_s: float, to_s: float) -> None:
    """Add an edit over a range by the form."""
    page.evaluate("document.querySelector('#edit-range').open = true")
    page.locator("#edit-kind").select_option(kind)
    page.fill("#edit-from", str(from_s))
    page.fill("#edit-to", str(to_s))
    page.locator("#edit-add").click()


@pytest.mark.long
def test_edits_over_a_range_are_added_moved_switched_and_taken_back(
    address: str, take: Take, page: Page, chromium: Browser
) -> None:
    opened(page, address)
    add_over(page, "contact_floor", 0.5, 1.0)
    (contact,) = edits(take, 1).edits
    begins_s = patient.get(f"{address}/api/v1/replay").json()["begins_s"]
    assert (contact.joint, contact.touches) == ("left_ankle", "floor")
    assert (contact.start_s - begins_s, contact.end_s - begins_s) == pytest.approx((0.5, 1.0), abs=0.01)
    row = page.locator("#edit-list li")
    expect(row).to_contain_text("On the floor: left ankle")

    with quiet_page(chromium) as other:  # another browser sees it, and switches it off
        opened(other, address)
        other.get_by_label("Honour: On the floor: left ankle").uncheck()
        expect(row).to_have_class("off")
        expect(page.locator("#undo")).to_have_attribute("title", "Undo (Ctrl+Z): edit of another browser")
        page.keyboard.press("Control+z")
        expect(other.locator("#edit-list li")).not_to_have_class("off")
        expect(row).not_to_have_class("off")

    box = page.locator("#timeline").bounding_box()
    assert box is not None
    y = box["y"] + box["height"] - 13  # the last lane
    frames = patient.get(f"{address}/api/v1/replay").json()["frames"]

    def x(seconds: float) -> float:
        return box["x"] + 96 + (box["width"] - 96 - 6) * seconds * 60 / (frames - 1)

    page.mouse.move(x(1.0) - 1, y)
    page.mouse.down()
    page.mouse.move(x(1.25), y, steps=3)
    page.mouse.up()
    until(lambda: abs(read_edits(take).edits[0].end_s - begins_s - 1.25) < 0.05)
    assert read_edits(take).edits[0].start_s == contact.start_s

    page.evaluate("document.querySelector('#edit-range').open = true")
    page.locator("#edit-kind").select_option("leave_out")
    page.locator("#edit-camera").select_option("camera_1")
    add_over(page, "leave_out", 1.0, 1.5)
    assert edits(take, 2).edits[1].camera == "camera_1"
    until(lambda: solved_with(take) == read_edits(take).revision)
    page.keyboard.press("Control+z")
    edits(take, 1)
    page.keyboard.press("Control+Shift+Z")
    edits(take, 2)
    page.get_by_label("Remove: Left out: camera_1, all joints").click()
    edits(take, 1)
    page.locator("#edit-without").click()
    until(lambda: "without-edits" in take.solve_names())
    assert "edits_revision" not in (read_metrics(take.solve_folder("without-edits")) or {})

    page.evaluate("localStorage.setItem('language', 'fr')")
    page.reload()
    expect(row).to_contain_text("Au sol : cheville gauche")
