"""The 3D view in a real browser, and its routes."""

import io
import time

import httpx
import numpy as np
import pytest
from PIL import Image
from playwright.sync_api import Page

from studio.web.palette import CAMERA_COLOURS, camera_colours, confidence_colours
from tests.web.stages import CAMERAS, FakeStage, step, until


def pixels(page: Page) -> np.ndarray:
    """The page as it looks, shape (height, width, 3)."""
    with Image.open(io.BytesIO(page.screenshot())) as picture:
        return np.asarray(picture.convert("RGB")).astype(int)


def body_pixels(page: Page) -> int:
    """Pixels of the mannequin's joints: blue-grey, darker than anything else on the stage."""
    colour = pixels(page)
    return int(((colour.max(axis=2) < 170) & (np.ptp(colour, axis=2) < 40)).sum())


def open_stage(page: Page, address: str) -> None:
    page.goto(f"{address}/viewer/")
    page.wait_for_selector("canvas")
    until(lambda: len(np.unique(pixels(page).reshape(-1, 3), axis=0)) > 200, timeout_s=30)


@pytest.mark.browser
def test_a_performer_is_drawn_and_hidden_when_lost(address: str, stage: FakeStage, page: Page) -> None:
    with stage.performing():
        open_stage(page, address)
        until(lambda: body_pixels(page) > 1500, timeout_s=30)
    until(lambda: body_pixels(page) < 200, timeout_s=15)


@pytest.mark.browser
def test_layers_are_switched_by_the_api(address: str, stage: FakeStage, page: Page) -> None:
    with stage.performing():
        open_stage(page, address)
        until(lambda: body_pixels(page) > 1500, timeout_s=30)
        answer = httpx.put(f"{address}/api/v1/view", json={"layers": {"character": False, "fused": False}})
        assert answer.json()["layers"]["character"] == {"label": "Character", "shown": False}
        until(lambda: body_pixels(page) < 300, timeout_s=15)


def test_routes_tell_layers_and_colours_and_refuse_others(address: str) -> None:
    until(lambda: bool(httpx.get(f"{address}/api/v1/view").json()["colours"]))
    state = httpx.get(f"{address}/api/v1/view").json()
    assert set(state["layers"]) == {"character", "fused", "raw", "ghost", "trails", "cameras", "floor"}
    assert list(state["colours"]) == list(CAMERAS)
    answer = httpx.put(f"{address}/api/v1/view", json={"layers": {"nobody": True}})
    assert answer.status_code == 400 and "allowed: character, fused" in answer.text


def test_showing_never_waits(address: str, stage: FakeStage) -> None:
    steps = [step(x) for x in np.linspace(0, 0.3, 50)]
    begin_s = time.perf_counter()
    for _ in range(20):
        for each in steps:
            stage.callbacks[0](each)
    assert (time.perf_counter() - begin_s) / 1000 < 0.001


def test_colours() -> None:
    names = tuple(f"camera_{i}" for i in range(10))
    colours = camera_colours(names)
    assert len(set(colours.values())) == len(CAMERA_COLOURS) and colours["camera_8"] == CAMERA_COLOURS[0]
    red, amber, green = confidence_colours(np.array([0.0, 0.5, 1.0])).astype(int)
    assert red[0] > 2 * red[1] and amber[0] > amber[2] and green[1] > green[0]
