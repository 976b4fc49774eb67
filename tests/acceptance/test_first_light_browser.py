"""First light, as a user meets it: the real program, two real camera processes, a real browser.

Records five seconds with the button, solves the take again with other settings, exports it, and reads the files
with programs that were not written here. Screenshots stay in the test's temporary folder.
"""

import os
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from playwright.sync_api import Browser, Page, expect

from studio.engine.model.joints import OUTPUT_INDEX
from studio.engine.model.poses import Poses
from studio.take.folder.take import Take
from tests.acceptance.program import studio_program
from tests.engine.animation.export.readers.programs import read_with_bvhio, read_with_ufbx
from tests.engine.animation.export.scoring import position_error_cm
from tests.web.browser import quiet_page

CALIBRATED_MS = 150_000
SOLVED_MS = 120_000


def check_human(poses: Poses) -> None:
    """A person: rigid bones, feet on the floor and not under it, upright, moving, never jumping."""
    p = poses.positions_m
    assert poses.time_s[-1] - poses.time_s[0] > 3.0
    assert poses.frame_count > 60, "a busy machine leaves out some while it is live"
    bones = np.linalg.norm(p[:, 1:] - p[:, poses.parents[1:]], axis=-1)
    assert bones.std(axis=0).max() < 1e-4
    feet = p[
        :, [OUTPUT_INDEX[f"{side}{name}"] for side in ("Left", "Right") for name in ("Foot", "ToeBase")], 2
    ]
    assert feet.min() > -0.03 and np.median(feet.min(axis=1)) < 0.12
    assert (p[:, OUTPUT_INDEX["Head"], 2] > p[:, OUTPUT_INDEX["Hips"], 2]).mean() > 0.95
    speed = np.linalg.norm(np.diff(p[:, OUTPUT_INDEX["LeftHand"]], axis=0), axis=1) / np.diff(poses.time_s)
    assert speed.max() > 0.2
    assert np.percentile(speed, 99) < 12.0


def record(page: Page, name: str) -> None:
    """Record five seconds with the button."""
    page.fill("#take-name", name)
    page.locator("#record").click()
    expect(page.locator("#record .label")).to_have_text("Stop")
    page.wait_for_timeout(5000)
    page.locator("#record").click()
    expect(page.locator("#record .label")).to_have_text("Record", timeout=60_000)
    expect(page.locator(".take", has_text=name).locator(".solve-row")).to_have_count(1, timeout=60_000)


def export(page: Page, label: str, path: Path) -> Path:
    """Export in the format of the path's ending and keep what is downloaded."""
    page.get_by_role("button", name=label).click()
    page.locator("#export-format").select_option(path.suffix.removeprefix("."))
    with page.expect_download(timeout=SOLVED_MS) as download:
        page.locator("#export-run").click()
    expect(page.locator("#export-dialog")).to_be_hidden()
    download.value.save_as(path)
    return path


@pytest.mark.browser
@pytest.mark.timeout(900)
def test_first_light(tmp_path: Path, chromium: Browser) -> None:
    sessions = tmp_path / "sessions"
    sessions.mkdir()
    with studio_program(sessions) as host, quiet_page(chromium) as page:
        page.goto(f"http://{host}/")
        expect(page.locator("#cameras .camera")).to_have_count(2, timeout=60_000)
        expect(page.locator("#calibration-badge")).to_have_text("calibrating", timeout=60_000)
        expect(page.locator("#wizard")).to_be_hidden()  # the simulated performer is seen meanwhile
        page.screenshot(path=tmp_path / "calibrating.png")
        expect(page.locator("#calibration-badge")).to_have_text(
            re.compile("good|usable"), timeout=CALIBRATED_MS
        )
        expect(page.locator("#notice")).to_be_hidden(timeout=60_000)
        page.screenshot(path=tmp_path / "live.png")
        record(page, "first")
        page.screenshot(path=tmp_path / "recorded.png")

        page.locator("#switches > summary").click()
        page.select_option("#switch-smoothing", "one_euro:before")
        take = page.locator(".take", has_text="first")
        take.get_by_role("button", name="Solve first", exact=True).click()
        expect(take.locator(".solve-row")).to_have_count(2, timeout=SOLVED_MS)
        bvh = export(page, "Export first, solve studio_2", tmp_path / "first.bvh")
        fbx = export(page, "Export first, solve studio_2", tmp_path / "first.fbx")
        page.screenshot(path=tmp_path / "exported.png")

    path = next(sessions.glob("*/first"))
    live = Poses.load(path / "solves" / "live" / "poses.npz")
    again = Poses.load(path / "solves" / "studio_2" / "poses.npz")
    check_human(live)
    check_human(again)
    assert '"smoothing": "one_euro:before"' in (path / "solves" / "studio_2" / "settings.json").read_text()
    assert len(Take.open(path).camera_names) == 2

    solve = [sys.executable, "-m", "studio", "solve", str(path), "--as-live"]
    subprocess.run(solve, check=True, capture_output=True, env=os.environ, timeout=300)
    repeated = Poses.load(path / "solves" / "as-live" / "poses.npz")
    np.testing.assert_array_equal(repeated.time_s, live.time_s)
    np.testing.assert_array_equal(repeated.positions_m, live.positions_m)
    np.testing.assert_array_equal(repeated.rotations_wxyz, live.rotations_wxyz)

    assert position_error_cm(read_with_bvhio(bvh), again).max() < 0.1
    assert position_error_cm(read_with_ufbx(fbx, hz=again.frames_per_second), again).max() < 0.1
