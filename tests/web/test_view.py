"""The 3D view in a real browser, and its routes."""

import io
import threading
from dataclasses import replace

import numpy as np
import pytest
from fastapi import FastAPI
from PIL import Image
from playwright.sync_api import Page

from studio.engine.model.frames import StepResult
from studio.live.states import PerformerStatus
from studio.web import ViewHandle
from studio.web.scene.drawing import Wanted
from studio.web.scene.palette import CAMERA_COLOURS, camera_colours, confidence_colours
from tests import patient
from tests.web.browser import LIVELY_MS
from tests.web.stages import CAMERAS, FakeStage, step, until

pytestmark = pytest.mark.lively


def pixels(page: Page) -> np.ndarray:
    """The page as it looks once it is drawn anew, shape (height, width, 3)."""
    page.wait_for_timeout(LIVELY_MS)
    with Image.open(io.BytesIO(page.screenshot())) as picture:
        return np.asarray(picture.convert("RGB")).astype(int)


def open_stage(page: Page, address: str) -> np.ndarray:
    """Open the view with nobody on it; return how it looks."""
    page.goto(f"{address}/viewer/")
    page.wait_for_selector("canvas")
    until(lambda: len(np.unique(pixels(page) @ [1 << 16, 1 << 8, 1])) > 200)  # so many colours
    last = pixels(page)

    def at_rest() -> bool:
        nonlocal last
        before, last = last, pixels(page)
        return bool((before == last).all()) and reddish(last) > 100  # the first camera's frustum is orange

    until(at_rest)
    return last


def reddish(picture: np.ndarray) -> int:
    return int((picture[:, :, 0] > picture[:, :, 2] + 40).sum())


def changed(page: Page, empty: np.ndarray) -> int:
    """How many blocks of 8 x 8 pixels differ from the empty stage.

    Blocks, because the viewer draws with fewer pixels on a busy machine: edges and lines get other widths.
    """
    return int((np.abs(blocks(pixels(page)) - blocks(empty)).max(axis=2) > 12).sum())


def blocks(picture: np.ndarray) -> np.ndarray:
    """Means of blocks of 8 x 8 pixels, shape (height / 8, width / 8, 3)."""
    height, width = (8 * (n // 8) for n in picture.shape[:2])
    return picture[:height, :width].reshape(height // 8, 8, width // 8, 8, 3).mean(axis=(1, 3))


@pytest.mark.browser
def test_a_performer_is_drawn_and_hidden_when_lost(address: str, stage: FakeStage, page: Page) -> None:
    empty = open_stage(page, address)
    with stage.performing():
        until(lambda: changed(page, empty) > 80)
    until(lambda: changed(page, empty) < 3)


def two_and_a_stranger(shift_m: float) -> StepResult:
    """Two performers beside each other, and behind them a stranger."""
    first, second = step(-0.9), replace(step(0.9 + shift_m), performer=2)
    behind = first.fused.positions + np.array([0.9, 1.5, 0.0])
    return replace(first, others=(second,), strangers=(behind,))


@pytest.mark.browser
def test_performers_have_colours_and_names_of_their_own(address: str, stage: FakeStage, page: Page) -> None:
    stage.performers = [
        PerformerStatus(number, name, "here", 1.75) for number, name in ((1, "Ada"), (2, "Bo"))
    ]
    empty = open_stage(page, address)
    left, right = slice(0, empty.shape[1] // 2), slice(empty.shape[1] // 2, None)

    def more_red(half: slice) -> int:
        """How many more pixels than on the empty stage are warm (cold: below 0)."""
        new = pixels(page)[:, half] - empty[:, half]
        return int((new[..., 0] - new[..., 2] > 15).sum() - (new[..., 2] - new[..., 0] > 15).sum())

    with stage.performing(two_and_a_stranger):
        until(lambda: more_red(right) > 5000 and more_red(left) < -5000)
        stage.performers = []
    with stage.performing():
        until(lambda: abs(more_red(left)) < 1000 and abs(more_red(right)) < 1000)  # its joints are dark blue


@pytest.mark.browser
def test_layers_are_switched_by_the_api(address: str, stage: FakeStage, page: Page) -> None:
    empty = open_stage(page, address)
    with stage.performing():
        until(lambda: changed(page, empty) > 80)
        answer = patient.put(f"{address}/api/v1/view", json={"layers": {"character": False}})
        assert answer.json()["layers"]["character"] == {"label": "Character", "shown": False}
        until(lambda: changed(page, empty) < 3)
        patient.put(
            f"{address}/api/v1/view", json={"layers": {"raw": True, "fused": True, "effectors": True}}
        )
        until(lambda: changed(page, empty) > 8)


def test_routes_tell_layers_and_colours_and_refuse_others(address: str) -> None:
    until(lambda: bool(patient.get(f"{address}/api/v1/view").json()["colours"]))
    state = patient.get(f"{address}/api/v1/view").json()
    assert set(state["layers"]) == {
        "character",
        "fused",
        "raw",
        "ghost",
        "bodies",
        "trails",
        "effectors",
        "points",
        "cameras",
        "floor",
    }
    assert list(state["colours"]) == list(CAMERAS)
    answer = patient.put(f"{address}/api/v1/view", json={"layers": {"nobody": True}})
    assert answer.status_code == 400 and "allowed: character, fused" in answer.text
    assert state["points"] == {
        "colour": "camera", "colours": ["camera", "confidence"], "cameras": {}, "problem": "",
    }  # fmt: skip
    for wrong, allowed in (
        ({"colour": "red"}, "camera, confidence"),
        ({"cameras": {"x": True}}, "left, right"),
    ):
        answer = patient.put(f"{address}/api/v1/view", json={"points": wrong})
        assert answer.status_code == 400 and f"allowed: {allowed}" in answer.text


def test_showing_never_waits(
    handle: tuple[ViewHandle, FastAPI], stage: FakeStage, monkeypatch: pytest.MonkeyPatch
) -> None:
    """While a picture is drawn, steps are taken in all the same, and what is drawn next is the newest."""
    drawing, go_on = threading.Event(), threading.Event()
    drawn: list[StepResult] = []

    def draw(wanted: Wanted, now_s: float) -> None:
        if wanted.live is not None:
            drawn.append(wanted.live)
            drawing.set()
            go_on.wait()

    monkeypatch.setattr(handle[0].view._drawing, "draw", draw)
    steps = [step(x) for x in np.linspace(0, 0.3, 50)]
    try:
        stage.callbacks[0](steps[0])
        assert drawing.wait(60)
        given = threading.Thread(target=lambda: [stage.callbacks[0](each) for each in steps], daemon=True)
        given.start()
        given.join(60)
        assert not given.is_alive(), "a step waited for the picture"
        assert len(drawn) == 1, "the picture was done before the steps were given"
    finally:
        go_on.set()
    until(lambda: len(drawn) > 1)
    assert drawn[1] is steps[-1]


def test_colours() -> None:
    names = tuple(f"camera_{i}" for i in range(10))
    colours = camera_colours(names)
    assert len(set(colours.values())) == len(CAMERA_COLOURS) and colours["camera_8"] == CAMERA_COLOURS[0]
    red, amber, green = confidence_colours(np.array([0.0, 0.5, 1.0])).astype(int)
    assert red[0] > 2 * red[1] and amber[0] > amber[2] and green[1] > green[0]
