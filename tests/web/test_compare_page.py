"""The compare view, references and the export dialog in a real browser."""

import json
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from playwright.sync_api import Page, expect

from studio.engine.animation.export import EXPORTERS
from studio.engine.metrics.reference.canonical import canonical_positions
from studio.engine.model.joints import CANONICAL
from studio.engine.model.poses import Poses
from tests import patient
from tests.engine.animation.retarget.rigs import write_rig
from tests.poses_factory import t_pose
from tests.web.browser import wait_for_undos
from tests.web.playback.takes import take_with_solves
from tests.web.stages import until
from tests.web.test_page import serving, studio

pytestmark = pytest.mark.browser


@pytest.fixture
def address(tmp_path: Path) -> Iterator[str]:
    """Address of a studio with two takes."""
    take_with_solves(tmp_path / "monday" / "one")
    take_with_solves(tmp_path / "monday" / "two", seed=1)
    with studio(tmp_path) as (app, _), serving(app) as url:
        yield url


def reference_csv(poses: Poses) -> str:
    """The joints of poses 20 mm higher, as a CSV."""
    rows = [",".join(["time_s", *(f"{joint}_{axis}" for joint in CANONICAL for axis in "xyz")])]
    joints = canonical_positions(poses) + np.array([0.0, 0.0, 0.02])
    for time_s, row in zip(poses.time_s, joints, strict=True):
        rows.append(",".join(f"{value:.6f}" for value in (time_s, *np.ravel(row))))
    return "\n".join(rows) + "\n"


def replay(address: str) -> dict:
    return patient.get(f"{address}/api/v1/replay").json()


def test_a_reference_is_loaded_compared_and_removed(address: str, page: Page, tmp_path: Path) -> None:
    file = tmp_path / "truth.csv"
    file.write_text(reference_csv(Poses.load(tmp_path / "monday/one/solves/live/poses.npz")))
    page.goto(address)
    page.get_by_role("button", name="Replay one, solve studio").click()
    page.locator("#replay-compare").click()
    compare = page.locator("#compare")
    expect(compare.locator("#compare-b")).to_have_value("monday/one|live")
    expect(compare.locator(".joints")).to_contain_text("left wrist")
    expect(compare.locator(".summary")).to_contain_text("mean 0")  # the two solves are the same
    expect(compare.locator(".figures")).to_contain_text("Jitter")
    page.locator("#compare-beside").click()
    expect(page.locator("#compare-beside")).to_have_attribute("aria-pressed", "true")
    page.get_by_role("button", name="10 ms later").click()
    expect(compare.locator("#compare-offset")).to_have_value("10")
    until(lambda: [replay(address)[name] for name in ("ghost_apart_m", "ghost_offset_ms")] == [1.4, 10])
    page.locator("#reference-file").set_input_files(file)
    expect(compare.locator(".away")).to_contain_text("21 of 21 joints")
    expect(compare.locator("#compare-b")).to_have_value("monday/one|ref:truth.csv")
    expect(compare.locator(".figures")).to_contain_text("Mean error")
    page.get_by_role("button", name="Make the report").click()
    link = page.get_by_role("link", name="Open the report").get_attribute("href")
    assert "<svg" in patient.get(link).text
    page.get_by_role("button", name="Remove truth.csv").click()
    expect(compare.locator(".reference-row")).to_have_count(0)
    until(lambda: replay(address)["ghost"] is None)
    wait_for_undos(page, 1)
    page.keyboard.press("Control+z")
    expect(compare.locator(".reference-row")).to_contain_text("truth.csv")
    page.reload()
    expect(compare.locator(".reference-row")).to_contain_text("truth.csv")
    compare.get_by_role("button", name="Close").click()
    expect(compare).to_be_hidden()


def test_closing_takes_the_second_figure_away(address: str, page: Page) -> None:
    page.goto(address)
    page.get_by_role("button", name="Replay one, solve studio").click()
    page.locator("#replay-compare").click()
    until(lambda: replay(address)["ghost"] is not None)
    page.locator("#compare-beside").click()
    page.locator("#compare-close").click()
    until(lambda: replay(address)["ghost"] is None)
    expect(page.locator("#compare")).to_be_hidden()
    page.locator("#replay-compare").click()
    until(lambda: replay(address)["ghost"] is not None)


def test_a_format_that_cannot_be_written_says_why(
    address: str, page: Page, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(EXPORTERS, "usd", replace(EXPORTERS["usd"], needs="a_module_of_no_package"))
    page.goto(address)
    page.get_by_role("button", name="Export one, solve studio").click()
    for name in ("usd", "mkv"):
        expect(page.locator(f"#export-format option[value={name}]")).to_be_disabled()
    expect(page.locator("#export-format option[value=bvh]")).to_be_enabled()
    expect(page.locator("#export-missing")).to_contain_text("USD is not installed here: pip install")
    expect(page.locator("#export-missing")).to_contain_text("This take has no depth")


def test_exports_for_programs_and_onto_a_rig(address: str, page: Page, tmp_path: Path) -> None:
    rig = write_rig(tmp_path / "hero.glb", t_pose(2), "vrm", "child", True)
    page.goto(address)
    page.get_by_role("button", name="Export one, solve studio").click()
    dialog = page.get_by_role("dialog")
    dialog.get_by_text("OpenSim", exact=True).click()
    expect(page.locator("#export-format")).to_have_value("trc")
    expect(page.locator("#export-mesh")).to_be_hidden()
    dialog.get_by_text("Your own rig", exact=True).click()
    expect(page.locator("#export-run")).to_be_disabled()
    page.locator("#export-rig-file").set_input_files(rig)
    expect(dialog).to_contain_text("52 of its 52 bones")
    expect(page.locator("#export-format")).to_have_value("glb")
    page.locator(".mapping > summary").click()
    dialog.get_by_label("Bone of Head", exact=True).select_option("")
    expect(dialog).to_contain_text("51 of its 52 bones")
    with page.expect_download(timeout=120_000) as download:
        page.locator("#export-run").click()
    assert download.value.suggested_filename == "one_studio_hero.glb"
    data = Path(download.value.path()).read_bytes()
    names = {
        node["name"] for node in json.loads(data[20 : 20 + int.from_bytes(data[12:16], "little")])["nodes"]
    }
    assert {"hips", "leftUpperLeg"} <= names
    page.get_by_label("Select one").check()
    page.get_by_label("Select two").check()
    page.locator("#selected-export").click()
    expect(dialog.get_by_label("Solve of two")).to_have_value("studio")
    dialog.get_by_text("MotionBuilder, Maya", exact=True).click()
    dialog.get_by_label("All takes in one file").check()
    with page.expect_download(timeout=120_000) as download:
        page.locator("#export-run").click()
    assert download.value.suggested_filename == "takes_2.fbx"
