"""A take of videos is calibrated from the page: by a board, anew by the performer's height, and as it was before."""

import re
from pathlib import Path

import pytest
from playwright.sync_api import Page, expect

from studio.take.folder.take import Take
from tests.offline.boards import A0, CAMERAS, Shown, lying, take_with_boards
from tests.web.axe import AXE, violations
from tests.web.test_page import serving, studio

pytestmark = pytest.mark.browser


def found_by_axe(page: Page) -> list[str]:
    """What axe finds, where it is fetched."""
    return violations(page) if AXE.is_file() else []


@pytest.mark.viewing
def test_a_take_is_calibrated_by_its_board_anew_and_as_before(tmp_path: Path, page: Page) -> None:
    shown = [Shown(A0, lying(0.3, 0.2, 30.0))]
    made = take_with_boards(tmp_path / "monday" / "walk", {name: shown for name in CAMERAS})
    for camera in made.meta["cameras"]:
        camera["joint_set"] = "mediapipe"  # as that of every camera without depth
    made.save_meta()
    with studio(tmp_path) as (app, _), serving(app) as url:
        page.goto(url)
        dialog, messages = page.locator("dialog.ask"), page.locator("#messages")
        page.get_by_role("button", name="Calibrate walk").click()
        expect(dialog.locator(".lens")).to_have_count(2)
        dialog.locator("#board").select_option("charuco")
        for name, value in {"columns": 4, "rows": 5, "square": 200, "marker": 150}.items():
            dialog.locator(f"#board-{name}").fill(str(value))
        with page.expect_popup() as sheet:
            dialog.get_by_role("button", name="Print").click()
        assert sheet.value.locator("svg path").count() == 1
        sheet.value.close()
        dialog.get_by_role("button", name="Calibrate", exact=True).click()
        expect(messages).to_contain_text(
            re.compile(r"Cameras: \d .*The performer is 1\.[78]\d m tall in shoes")
        )
        expect(dialog.locator(".verdict")).to_have_count(2)
        assert found_by_axe(page) == []
        expect(dialog).to_contain_text(re.compile(r"is known to .* cm and .* degrees only"))
        dialog.get_by_role("button", name="Close").click()

        page.get_by_role("button", name="Edit walk").click()
        page.get_by_role("button", name="Calibrate again").click()
        assert found_by_axe(page) == []
        dialog.locator("#board").select_option("")
        dialog.locator("#take-tall").fill("1.6")
        dialog.get_by_role("button", name="Calibrate", exact=True).click()
        expect(messages).to_contain_text("The performer is 1.62 m tall in shoes")
        dialog.get_by_role("button", name="Close").click()
        assert Take.open(made.path).meta["calibration"] == 2
        with page.expect_response("**/calibrations/in_use"):
            messages.get_by_role("button", name="Undo").click()
        assert Take.open(made.path).meta["calibration"] == 1

        made.calibration_path(1).write_text("damaged")  # which calibrating anew mends
        page.get_by_role("button", name="Edit walk").click()
        page.get_by_role("button", name="Calibrate again").click()
        dialog.get_by_role("button", name="Calibrate", exact=True).click()
        dialog.get_by_role("button", name="Close").click()
        assert Take.open(made.path).meta["calibration"] == 3
