"""Points in a real browser: those of the right camera appear and disappear, in replay and live, and what is told."""

import io
import re
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from playwright.sync_api import Page, expect

from studio.live.calibration.kept import save_calibration
from studio.take.raw.records import intrinsics_of
from studio.web.scene.palette import CAMERA_COLOURS, confidence_colours
from studio.wire import Message, depth_image, preview_array, preview_image
from tests import patient
from tests.api.camera import Camera
from tests.web.browser import LIVELY_MS
from tests.web.points.depth_takes import CAMERAS, DAMAGED, GAP, calibration, images, stage, take_with_depth
from tests.web.stages import serving, until
from tests.web.test_page import studio

pytestmark = pytest.mark.browser
FIRST, SECOND = CAMERA_COLOURS[:2]
SURE = tuple(confidence_colours(np.array([1.0]))[0].tolist())
SEEN = 300
OVER_PX = (280, 60)
"""Space that the menu of layers and the tools cover in the view, at the left and at the bottom."""


@pytest.fixture
def address(tmp_path: Path) -> Iterator[str]:
    """A studio with a take with depth, and a session's calibration for the live stage."""
    take_with_depth(tmp_path / "monday" / "still")
    (tmp_path / "calibrations").mkdir()
    save_calibration(tmp_path / "calibrations", calibration(), None)
    with studio(tmp_path) as (app, _), serving(app) as url:
        yield url


def coloured(page: Page, rgb: tuple[int, int, int]) -> int:
    """How many pixels of the 3D view have about this colour, where nothing lies over it, once it is drawn anew."""
    page.wait_for_timeout(LIVELY_MS)
    with Image.open(io.BytesIO(page.locator("#viewer").screenshot())) as shot:
        pixels = np.asarray(shot.convert("RGB"), dtype=float)[: -OVER_PX[1], OVER_PX[0] :]
    near = np.abs(pixels - rgb).max(axis=2) < 40
    return int(near.sum())


def change(address: str, **wanted: object) -> None:
    patient.put(f"{address}/api/v1/view", json=wanted).raise_for_status()


def replay(page: Page, address: str, frame: int = 2, solve: str = "studio") -> None:
    """Open the take at a frame with nothing but points shown."""
    page.goto(address)
    view = patient.get(f"{address}/api/v1/view").json()
    change(address, layers={name: name == "points" for name in view["layers"]})
    patient.put(f"{address}/api/v1/replay", json={"take": "monday/still", "solve": solve}).raise_for_status()
    go(address, frame)


def go(address: str, frame: int) -> None:
    patient.patch(f"{address}/api/v1/replay", json={"frame": frame}).raise_for_status()


@pytest.mark.lively
def test_points_of_each_camera_come_and_go(address: str, page: Page) -> None:
    replay(page, address)
    said = page.locator("#points-said")
    expect(said).to_have_text("18,000 points")
    until(lambda: coloured(page, FIRST) > SEEN and coloured(page, SECOND) > SEEN)
    page.locator("#view-layers > summary").click()
    page.locator(f"#points-of-{CAMERAS[0]}").click()
    until(lambda: coloured(page, FIRST) < SEEN / 10 and coloured(page, SECOND) > SEEN)
    page.locator(f"#points-of-{CAMERAS[0]}").click()
    page.locator(f"#points-of-{CAMERAS[1]}").click()
    until(lambda: coloured(page, SECOND) < SEEN / 10 and coloured(page, FIRST) > SEEN)
    page.locator(f"#points-of-{CAMERAS[1]}").click()
    page.locator("#points-by-confidence").click()
    expect(said).to_have_text("12,000 points")
    until(lambda: coloured(page, SURE) > SEEN and coloured(page, FIRST) < SEEN / 10)
    page.locator("#layer-points").uncheck()
    until(lambda: coloured(page, SURE) < SEEN / 10)
    expect(said).to_be_hidden()


@pytest.mark.lively
def test_what_is_missing_is_said(address: str, page: Page) -> None:
    replay(page, address, GAP[3])
    said = page.locator("#points-said")
    expect(said).to_have_text(f"18,000 points · {CAMERAS[1]}: no depth image now")
    until(lambda: coloured(page, FIRST) > SEEN and coloured(page, SECOND) < SEEN / 10)
    go(address, DAMAGED)
    expect(said).to_have_text(f"18,000 points · {CAMERAS[1]}: the depth image is damaged")
    go(address, 2)
    expect(said).to_have_text("18,000 points")
    until(lambda: coloured(page, SECOND) > SEEN)


@pytest.mark.lively
def test_a_take_that_plays_says_how_often_and_how_much(address: str, page: Page) -> None:
    replay(page, address, solve="")
    until(lambda: coloured(page, FIRST) > SEEN)
    patient.patch(f"{address}/api/v1/replay", json={"playing": True}).raise_for_status()
    said = page.locator("#points-said")
    figures = re.compile(r"points · (\d+) fps · (\d\.\d) MB/s")
    found: list[str] = []  # read once: a busy machine may show none a moment later
    until(lambda: bool(found.extend(figures.findall(said.inner_text())) or found))
    assert int(found[0][0]) <= 21 and float(found[0][1]) <= 2.3
    assert "which a tablet takes" in (said.get_attribute("title") or "")


@pytest.mark.viewing
def test_the_words_are_french_in_a_french_browser(address: str, page: Page) -> None:
    page.goto(address)
    page.evaluate("localStorage.setItem('language', 'fr')")
    replay(page, address, GAP[3])
    expect(page.locator("#points-said")).to_have_text(
        re.compile(f"18\\s000 points · {CAMERAS[1]}\\s: aucune image de profondeur à cet instant")
    )
    page.locator("#view-layers > summary").click()
    expect(page.locator("#points-by-confidence")).to_have_text("Couleur par confiance")


@contextmanager
def sending(camera: Camera, message: Callable[[], Message]) -> Iterator[None]:
    """A camera sends messages, some 20 a second, while the block runs."""
    stop = threading.Event()

    def send() -> None:
        while not stop.wait(0.05):
            camera.send(message())

    thread = threading.Thread(target=send)
    thread.start()
    try:
        yield
    finally:
        stop.set()
        thread.join()


@pytest.mark.lively
def test_live_depth_is_shown_as_it_comes(address: str, page: Page) -> None:
    """Small images at any time, whole ones while a take is recorded; what no longer comes is no longer shown."""
    page.goto(address)
    view = patient.get(f"{address}/api/v1/view").json()
    change(address, layers={name: name == "points" for name in view["layers"]})
    said = page.locator("#points-said")
    expect(said).to_have_text("No camera sends depth")
    with Camera(address.replace("http", "ws") + "/api/v1/link", 0) as camera:
        camera.greet(intrinsics=intrinsics_of(stage().sensor.camera))
        small = preview_image(0, images()[0])
        count = int((preview_array(small) > 0).sum())
        with sending(camera, lambda: small):
            expect(said).to_contain_text(f"{count:,} points")
            until(lambda: coloured(page, FIRST) > SEEN)
        expect(said).to_have_text(f"{CAMERAS[0]}: no depth image now")
        until(lambda: coloured(page, FIRST) < SEEN / 10)
        patient.post(f"{address}/api/v1/record/start", json={}).raise_for_status()
        with sending(camera, lambda: depth_image(1, camera.clock_ns(), images()[0])):
            expect(said).to_contain_text("18,000 points")
            until(lambda: coloured(page, FIRST) > SEEN)
        patient.post(f"{address}/api/v1/record/stop").raise_for_status()
