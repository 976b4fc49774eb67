"""A whole shoot with two phones, as an operator does it on the page: from the QR code to the FBX of another program.

The phones are Chromium with real videos as their cameras: a person on a treadmill, slowed down as `as_walk` says.
A performer on one spot does not show the focal lengths, so the lenses are given, as a refused calibration asks for.
Pictures go to the folder that `PICTURES` names, if it is set.
"""

import io
import os
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
import zxingcpp
from PIL import Image
from playwright.sync_api import Browser, Locator, Page, expect

from studio.__main__ import main
from studio.engine.model.poses import Poses
from tests.acceptance.processes import wait_until
from tests.acceptance.test_open_to_network import open_program
from tests.engine.animation.export.readers.programs import read_with_ufbx
from tests.engine.animation.export.scoring import position_error_cm
from tests.web.phones import Phone, as_walk, phone

PATIENCE_MS = 180_000
HEIGHT_M = "1.72"
FIELD_DEG = "59.5"
PERFORMED = 40
"""Frames of each phone in the take."""


def picture(page: Page, name: str) -> None:
    """Keep what a page shows, where pictures are asked for."""
    if folder := os.environ.get("PICTURES"):
        page.screenshot(path=Path(folder) / f"{name}.png")


def read_code(shown: Locator) -> str:
    """What another program reads in the QR code on the screen."""
    expect(shown).to_be_visible()

    def look() -> str:  # as a phone does: again and again, the first picture may be too early
        codes = zxingcpp.read_barcodes(Image.open(io.BytesIO(shown.page.screenshot())))
        return codes[0].text if codes else ""

    return wait_until(look, "another program reads the code")


@pytest.fixture
def operator(chromium: Browser, tmp_path: Path) -> Iterator[tuple[Page, Path, str]]:
    """The page of an operator who has signed in, the folder of takes, and the phones' host."""
    sessions = tmp_path / "sessions"
    assert main(["certificate", "--sessions", str(sessions)]) == 0
    with open_program(sessions) as (url, token, _, errors):
        context = chromium.new_context(ignore_https_errors=True, viewport={"width": 1280, "height": 720})
        page = context.new_page()
        page.set_default_timeout(PATIENCE_MS)
        page.goto(url)
        page.fill("#token", token)
        page.click("button[type=submit]")
        page.wait_for_selector("body[data-connection=open]")
        yield page, sessions, url
        context.close()
        assert errors.read_text() == ""


def let_in(page: Page, phones: dict[str, Phone]) -> None:
    """Each phone reads a code of its own from the operator's screen."""
    page.get_by_role("button", name="Other cameras").click()
    page.click("#invite-phone")
    code = page.locator("#phone-invitation img")
    for number, (name, one) in enumerate(phones.items()):
        if number:
            before = code.get_attribute("src")
            page.get_by_role("button", name="Code for another phone").click()
            expect(code).not_to_have_attribute("src", before or "")
        else:
            picture(page, "code")
        one.open(read_code(code), name)
    for one in phones.values():  # at about one moment, as the videos begin then
        one.page.click("#start")
    for one in phones.values():
        one.sends(10)
    page.keyboard.press("Escape")
    expect(page.locator("#cameras .camera")).to_have_count(len(phones))


def calibrate(page: Page, phones: dict[str, Phone]) -> None:
    page.locator("#calibrate").click()
    page.fill("#wizard-tall", HEIGHT_M)
    for name in phones:
        lens = page.locator(".lens", has_text=name)
        lens.locator("select").select_option("field")
        lens.locator(".lens-value").fill(FIELD_DEG)
        lens.locator(".lens-off").fill("0.5")
    picture(page, "lenses")
    page.click("#wizard-walk")
    expect(page.locator("#wizard[data-step=walk]")).to_be_visible()
    one = next(iter(phones.values()))
    one.sends(one.frames() + 30)
    picture(one.page, "phone")
    picture(page, "walk")
    expect(page.locator("#wizard[data-step=verdict]")).to_be_visible(timeout=PATIENCE_MS)
    picture(page, "verdict")
    words = page.locator("#wizard .wizard-main").inner_text()
    expect(page.locator("#wizard-pose"), words).to_be_visible()
    page.keyboard.press("Escape")


@pytest.mark.long  # a busy machine gives too few pictures in the 30 s of the walk
@pytest.mark.browser
@pytest.mark.timeout(1800)
def test_two_phones_from_the_code_to_the_fbx(
    operator: tuple[Page, Path, str], chromium: Browser, tmp_path: Path, test_data: Path
) -> None:
    page, sessions, _ = operator
    videos = test_data / "rgb" / "pose2sim_single"
    cameras = [as_walk(videos / f"cam0{n}.mp4", tmp_path / f"{n}.y4m") for n in (1, 4)]
    with phone(chromium, cameras[0]) as left, phone(chromium, cameras[1]) as right:
        phones = {"left": left, "right": right}
        let_in(page, phones)
        calibrate(page, phones)
        page.click("#record")
        for one in phones.values():
            expect(one.page.locator("#recording")).to_be_visible()
            one.sends(one.frames() + PERFORMED)
        picture(page, "recording")
        page.click("#record")
        expect(page.locator("#record .label")).to_have_text("Record")
        for one in phones.values():
            expect(one.page.locator("#recording")).to_be_hidden()
            assert one.complaints == []
    poses, file = solve_and_export(page, sessions, tmp_path)
    check(poses, file)


def solve_and_export(page: Page, sessions: Path, tmp_path: Path) -> tuple[Poses, Path]:
    """Finish the take, look at it in the replay, and download it."""
    page.select_option("#preset", "finish")
    take = page.locator(".take")
    take.get_by_role("button", name="Solve take").click()
    made = take.locator(".solve-row", has_text="finish")
    expect(made).to_be_visible(timeout=PATIENCE_MS)
    made.get_by_role("button", name="Replay").click()
    expect(page.locator("#replay-time")).to_be_visible()
    page.evaluate("document.querySelector('#messages .note button')?.click()")
    page.locator("#timeline").click()  # in its middle
    page.wait_for_selector("text=Loading the curves", state="hidden")
    picture(page, "replay")
    made.get_by_role("button", name="Export").first.click()
    page.locator("#export-format").select_option("fbx")
    with page.expect_download(timeout=PATIENCE_MS) as download:
        page.locator("#export-run").click()
    download.value.save_as(tmp_path / "take.fbx")
    (poses,) = sessions.glob("*/*/solves/finish/poses.npz")
    return Poses.load(poses), tmp_path / "take.fbx"


def check(poses: Poses, file: Path) -> None:
    """The file is the solve; the solve is a person who stands upright and stays about one spot.

    No more is asked for: a machine without a graphics card may give 2 frames a second of each camera, seldom at one
    moment.
    """
    exported = read_with_ufbx(file, hz=round(poses.frames_per_second))
    assert position_error_cm(exported, poses).max() < 0.1
    head, feet = (poses.positions_m[:, poses.joint_names.index(name), 2] for name in ("Head", "LeftFoot"))
    assert 1.3 < np.median(head - feet) < 1.7
    hips = poses.positions_m[:, poses.joint_names.index("Hips"), :2]
    assert (np.ptp(np.percentile(hips, [5, 95], axis=0), axis=0) < 1.0).all()
