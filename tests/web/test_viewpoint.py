"""Each browser's own viewpoint, in several real browsers at once: nobody moves another's, following is a choice."""

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from playwright.sync_api import Browser, BrowserContext, Page, expect

from tests import patient
from tests.acceptance.processes import server_process
from tests.live.performer import save_stage_calibration
from tests.web.servers import thread_server
from tests.web.stages import serving
from tests.web.test_page import NAMES, performing, studio

pytestmark = [pytest.mark.browser, pytest.mark.moving, pytest.mark.timeout(1800)]

CAMERA = (
    """addEventListener("message", ({ data }) => { if (data.type === "camera") window.camera = data; });"""
)
"""Keeps where the 3D view says that its camera is."""

PATIENCE_MS = 240_000
PATIENCE = PATIENCE_MS // 50
"""Several pictures in 3D at once are slow on a busy machine."""

FRONT, SIDE, STAGE, OWN = "Front", "Side", "Stage", "Own view"
FOLLOW = "Follow the operator's view"


def camera(page: Page) -> NDArray[np.float64]:
    """Where the page's camera is, and the middle of its picture, shape (2, 3)."""
    told = page.evaluate("window.camera && [camera.position, camera.target]")
    return np.full((2, 3), np.nan) if told is None else np.array(told)


def wait(page: Page, happens: Callable[[], bool], what: str) -> None:
    """Wait until something happens; the page goes on meanwhile."""
    for _ in range(PATIENCE):
        if happens():
            return
        page.wait_for_timeout(50)
    pytest.fail(f"waited in vain until {what}")


def at_rest(page: Page) -> NDArray[np.float64]:
    """The page's camera once it no longer moves."""
    before = camera(page)

    def rests() -> bool:
        nonlocal before
        page.wait_for_timeout(500)
        last, before = before, camera(page)
        return bool(np.abs(before - last).max() < 1e-6)

    wait(page, rests, "the camera rests")
    return before


def is_at(page: Page, look: NDArray[np.float64]) -> None:
    wait(page, lambda: bool(np.abs(camera(page) - look).max() < 0.005), f"the camera is at {look}")


def drag(page: Page) -> None:
    """Turn the view by hand."""
    box = page.locator("#viewer").bounding_box()
    assert box is not None
    x, y = box["x"] + 0.8 * box["width"], box["y"] + 0.3 * box["height"]  # beside the guide
    page.mouse.move(x, y)
    page.mouse.down()
    page.mouse.move(x + 120, y + 10, steps=6)
    page.mouse.up()


def press(page: Page, name: str) -> None:
    page.get_by_role("button", name=name, exact=True).click()


def open_in(context: Browser | BrowserContext, url: str) -> Page:
    page = context.new_page()
    page.add_init_script(CAMERA)
    page.goto(url)
    expect(page.locator("#connection")).to_have_text("Connected")
    expect(page.locator("#view-front")).to_be_visible()
    wait(page, lambda: bool(np.isfinite(camera(page)).all()), "the view has begun")
    at_rest(page)
    return page


def reload(page: Page) -> None:
    """Load the page anew and wait until its view has begun."""
    page.reload(wait_until="commit")
    wait(page, lambda: bool(np.isfinite(camera(page)).all()), "the view has begun")


@pytest.fixture
def stage(tmp_path: Path) -> Iterator[str]:
    """Address of a studio with two calibrated cameras, and nobody on stage."""
    save_stage_calibration(tmp_path, NAMES)
    with studio(tmp_path) as (app, _), serving(app) as url:
        yield url


@pytest.fixture
def browsers(chromium: Browser) -> Iterator[Callable[..., BrowserContext]]:
    """Opens browsers of their own, whose errors fail the test."""
    errors: list[str] = []
    opened: list[BrowserContext] = []

    def another(**options: Any) -> BrowserContext:
        context = chromium.new_context(**{"viewport": {"width": 1280, "height": 720}, **options})
        context.set_default_timeout(PATIENCE_MS)
        context.on("weberror", lambda error: errors.append(str(error.error)))
        opened.append(context)
        return context

    yield another
    for context in opened:
        context.close()
    assert errors == []


def test_each_browser_and_each_tab_has_its_own_viewpoint(stage: str, browsers: Callable) -> None:
    context = browsers()
    one, other, tab = open_in(context, stage), open_in(browsers(), stage), open_in(context, stage)
    first = camera(one)
    assert np.allclose(camera(other), first, atol=0.01), "all begin with the whole stage"
    press(one, FRONT)
    is_at(one, np.array([[0, -4.6, 1.35], [0, 0, 0.9]]))
    drag(other)
    turned = at_rest(other)
    assert np.abs(turned - first).max() > 0.3
    tab.keyboard.press("3")
    is_at(tab, np.array([[0, -0.02, 6.5], [0, 0, 0.9]]))
    is_at(one, np.array([[0, -4.6, 1.35], [0, 0, 0.9]]))
    is_at(other, turned)
    tab.close()
    for page, look in ((other, turned), (one, at_rest(one))):
        reload(page)
        is_at(page, look)


def test_following_is_a_choice_and_follow_and_orbit_are_this_browsers(stage: str, browsers: Callable) -> None:
    one, other = open_in(browsers(), stage), open_in(browsers(), stage)
    following_the_operator_is_a_choice(stage, one, other)
    what_the_operator_sees_is_in_a_narrower_picture_too(stage, browsers, other)
    follow_and_orbit_are_this_browsers(stage, one, other)
    press(other, FRONT)
    at_rest(other)
    expect(other.locator("#view-operator")).to_be_hidden()  # the one that moved last
    expect(one.locator("#view-operator")).to_be_enabled()
    expect(one.locator("#view-operator")).to_be_visible()
    other.goto("about:blank")  # a view of a page that is gone is not offered; it is the other's now
    expect(one.locator("#view-operator")).to_be_hidden()


def following_the_operator_is_a_choice(stage: str, one: Page, other: Page) -> None:
    press(one, FRONT)
    expect(one.locator("#view-operator")).to_be_hidden()
    press(other, FOLLOW)
    expect(other.locator("#view-operator")).to_have_text(OWN)
    is_at(other, at_rest(one))
    drag(one)
    turned = at_rest(one)
    is_at(other, turned)
    reload(other)
    expect(other.locator("#view-operator")).to_have_text(OWN)
    press(one, SIDE)
    is_at(other, np.array([[4.6, 0, 1.35], [0, 0, 0.9]]))
    drag(other)  # a page that looks elsewhere no longer follows
    expect(other.locator("#view-operator")).to_be_hidden()  # and is the one that moved last
    is_at(one, np.array([[4.6, 0, 1.35], [0, 0, 0.9]]))
    press(one, FOLLOW)
    is_at(one, at_rest(other))
    press(one, OWN)
    kept = at_rest(one)
    press(other, STAGE)
    at_rest(other)
    is_at(one, kept)


def what_the_operator_sees_is_in_a_narrower_picture_too(stage: str, browsers: Callable, one: Page) -> None:
    press(one, FRONT)
    phone = open_in(browsers(viewport={"width": 390, "height": 844}), stage)
    press(phone, FOLLOW)
    expected = at_rest(one)
    wait(phone, lambda: bool(camera(phone)[0, 1] < 1.3 * expected[0, 1]), "the phone looks from further away")
    assert np.allclose(camera(phone)[1], expected[1], atol=0.005)
    phone.close()


def follow_and_orbit_are_this_browsers(stage: str, one: Page, other: Page) -> None:
    press(one, STAGE)
    began, still = at_rest(one), at_rest(other)
    with performing(stage):
        one.keyboard.press("f")
        expect(one.locator("#view-follow")).to_have_attribute("aria-pressed", "true")
        expect(other.locator("#view-follow")).to_have_attribute("aria-pressed", "false")
        wait(one, lambda: bool(np.abs(camera(one) - began).max() > 0.3), "the performer is framed")
        one.keyboard.press("4")
        began = camera(one)
        wait(one, lambda: bool(np.abs(camera(one) - began).max() > 0.5), "the camera turns")
        reload(one)
        expect(one.locator("#view-orbit")).to_have_attribute("aria-pressed", "true")
        press(one, "Orbit")
        at_rest(one)
        assert np.allclose(camera(other), still, atol=0.005)


def test_a_viewer_chooses_too_and_moves_nobody(tmp_path: Path, browsers: Callable) -> None:
    save_stage_calibration(tmp_path / "sessions", NAMES)
    with thread_server(tmp_path / "sessions", signed_in=True) as server:
        context = browsers()
        token = server.operator_token()
        answer = context.request.post(f"{server.url}/api/v1/access/signin", data={"token": token})
        assert answer.ok, answer.text()
        operator = open_in(context, server.url)
        press(operator, FRONT)
        front = at_rest(operator)
        link = context.request.post(
            f"{server.url}/api/v1/access/viewers", headers={"Origin": server.url}
        ).json()["token"]
        context = browsers()
        assert context.request.post(f"{server.url}/api/v1/access/signin", data={"token": link}).ok
        viewer = open_in(context, server.url)
        expect(viewer.locator("#view-layers")).to_be_hidden()
        viewer.keyboard.press("2")
        side = np.array([[4.6, 0, 1.35], [0, 0, 0.9]])
        is_at(viewer, side)
        drag(viewer)
        turned = at_rest(viewer)
        is_at(operator, front)
        reload(viewer)
        is_at(viewer, turned)
        press(viewer, FOLLOW)
        is_at(viewer, front)
        press(operator, SIDE)
        is_at(viewer, side)
        viewer.keyboard.press("1")
        is_at(viewer, front)
        is_at(operator, side)
        expect(viewer.locator("#view-operator")).to_have_text(FOLLOW)


def test_viewpoints_outlive_a_server_that_was_killed(tmp_path: Path, browsers: Callable) -> None:
    save_stage_calibration(tmp_path / "sessions", NAMES)
    with server_process(tmp_path / "sessions") as server:
        one, other = open_in(browsers(), server.url), open_in(browsers(), server.url)
        third = open_in(browsers(), server.url)
        drag(one)
        press(other, FOLLOW)
        press(third, FRONT)
        drag(one)
        turned = at_rest(one)
        is_at(other, turned)
        server.kill()
        for page in (one, other, third):
            expect(page.locator("#curtain")).to_contain_text("Not live since")
            page.evaluate("window.camera = null")
        server.start()
        for page, look in ((one, turned), (other, turned), (third, at_rest(third))):
            expect(page.locator("#curtain")).to_be_hidden()
            is_at(page, look)
        expect(one.locator("#view-operator")).to_be_hidden()
        press(one, SIDE)
        is_at(other, np.array([[4.6, 0, 1.35], [0, 0, 0.9]]))
        is_at(third, np.array([[0, -4.6, 1.35], [0, 0, 0.9]]))


def test_what_is_no_viewpoint_is_refused(stage: str) -> None:
    good = {"page": 7, "position_m": [0, -4, 1], "target_m": [0, 0, 1], "aspect": 1.5, "moved": False}
    url = f"{stage}/api/v1/view/operator"
    assert patient.put(url, json=good).json() == {"page": 7}
    assert patient.put(url, json={**good, "page": 8}).json() == {"page": 7}, "it was not moved"
    assert patient.put(url, json={**good, "page": 8, "moved": True}).json() == {"page": 8}
    for wrong in ({"page": 0}, {"position_m": [0, 1e9, 0]}, {"aspect": 0}, {"target_m": [0, 1]}, {"x": 1}):
        assert patient.put(url, json={**good, **wrong}).status_code == 422, wrong
