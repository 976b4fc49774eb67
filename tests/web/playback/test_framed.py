"""How large the replayed performer is on the screen, in pixels: the whole motion fits, and nobody is small."""

import io
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image
from playwright.sync_api import Page, expect

from studio.engine.model.joints import OUTPUT_JOINTS
from studio.engine.model.settings.settings import preset
from studio.take.folder.solves import write_solve
from studio.take.folder.take import Take
from tests import patient
from tests.poses_factory import make_poses
from tests.web.playback.takes import add_picture
from tests.web.stages import serving, until
from tests.web.test_page import studio

pytestmark = [pytest.mark.browser, pytest.mark.lively]
FRAMES = 121


@pytest.fixture
def address(tmp_path: Path) -> Iterator[str]:
    """A studio with a take in which somebody with open arms goes two metres to the side."""
    take = Take.create(tmp_path / "monday" / "walk", session="monday", name="walk", source="import")
    take.meta["recording"] = "done"
    take.save_meta()
    still = np.tile([1.0, 0.0, 0.0, 0.0], (FRAMES, len(OUTPUT_JOINTS), 1))
    poses = make_poses(still, root_m=np.linspace([-1.0, 0.5, 0.94], [1.0, 0.5, 0.94], FRAMES))
    write_solve(take, "studio", settings=preset("studio"), poses=poses, metrics={})
    add_picture(take)
    with studio(tmp_path) as (app, _), serving(app) as url:
        yield url


def picture(page: Page) -> NDArray[np.int16]:
    with Image.open(io.BytesIO(page.locator("#viewer").screenshot())) as shot:
        return np.asarray(shot.convert("RGB"), dtype=np.int16)


def figure_px(page: Page, address: str) -> tuple[int, int, int, int]:
    """Left, top, right and bottom of what the character covers in the view [px]."""

    def show(shown: bool) -> None:
        patient.put(f"{address}/api/v1/view", json={"layers": {"character": shown}}).raise_for_status()

    show(False)
    page.wait_for_timeout(1500)
    without = picture(page)
    show(True)
    found: list[tuple[int, int, int, int]] = []

    def settled() -> bool:
        rows, columns = np.nonzero((np.abs(picture(page) - without) > 24).any(axis=2))
        if len(rows):
            found.append((columns.min(), rows.min(), columns.max(), rows.max()))
        return len(found) > 1 and found[-1] == found[-2]

    until(settled)
    return found[-1]


@pytest.mark.parametrize(
    ("width", "height"), [(1280, 720), pytest.param(1920, 1080, marks=pytest.mark.long), (390, 844)]
)
def test_the_performer_is_framed(address: str, page: Page, width: int, height: int) -> None:
    page.set_viewport_size({"width": width, "height": height})
    page.goto(address)
    view = patient.get(f"{address}/api/v1/view").json()
    off = {name: False for name in view["layers"] if name != "character"}
    patient.put(f"{address}/api/v1/view", json={"layers": off}).raise_for_status()
    expect(page.locator("#preset")).to_be_visible()
    page.wait_for_timeout(3000)  # the view has its own shape by then
    page.locator(".take-picture").click()
    expect(page.locator("#view-motion")).to_be_visible()
    sizes = []
    for key in ("Home", "End", "f"):
        page.keyboard.press(key)
        page.wait_for_timeout(1500)
        left, top, right, bottom = figure_px(page, address)
        sizes.append(bottom - top + 1)
        box = page.locator("#viewer").bounding_box()  # panels that came in the meantime leave less
        assert box is not None
        assert 0 < left and right < box["width"] - 1 and 0 < top and bottom < box["height"] - 1, key
    print(f"{width}x{height}: the view {box['width']:.0f}x{box['height']:.0f}, figure {sizes} px high")
    # In a wide picture the height decides how near one may look, in a narrow one the width of four metres.
    assert min(sizes[:2]) > 0.6 * min(box["height"], box["width"] * 1.75 / 4.0)
    wanted = 0.6 * min(box["height"], box["width"] * 1.75 / 2.0)
    for _ in range(20):  # a slow machine comes near later
        if sizes[2] > wanted:
            break
        page.wait_for_timeout(1500)
        _, top, _, bottom = figure_px(page, address)
        sizes[2] = bottom - top + 1
    assert sizes[2] > wanted
