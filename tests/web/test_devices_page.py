"""Devices of the server's machine in the dialog that adds cameras, in a real browser, with real camera clients."""

from collections.abc import Iterator
from itertools import product
from pathlib import Path

import psutil
import pytest
from playwright.sync_api import Browser, Page, expect

from tests import patient
from tests.acceptance.processes import wait_until
from tests.web.stages import serving
from tests.web.test_page import open_page, studio

pytestmark = pytest.mark.browser


@pytest.fixture
def empty(tmp_path: Path) -> Iterator[str]:
    """Address of a studio without cameras."""
    with studio(tmp_path / "sessions") as (app, _), serving(app) as url:
        yield url
        app.state.devices.close()


def client_of(name: str) -> list[psutil.Process]:
    """The process of the client of a camera, with those that it has started."""
    here = psutil.Process().children(recursive=True)
    clients = [one for one in here if one.status() != psutil.STATUS_ZOMBIE and name in one.cmdline()]
    return [each for one in clients for each in (one, *one.children(recursive=True))]


def test_a_device_is_connected_by_a_click_and_disconnected(empty: str, page: Page) -> None:
    open_page(page, empty)
    page.get_by_role("button", name="Other cameras").click()
    dialog = page.get_by_role("dialog", name="Add a camera")
    expect(dialog).to_contain_text("No camera is plugged in here")
    expect(dialog.get_by_text("kinds of cameras could not be looked for")).to_be_visible()
    device = dialog.locator("#simulated-devices .device").first
    picture = device.get_by_role("img", name="What simulated depth camera 1 sees")
    expect(picture).to_be_visible()
    wait_until(lambda: picture.evaluate("image => image.naturalWidth > 100"), "the picture is there")
    name = device.get_by_role("textbox", name="Name of the camera of simulated depth camera 1")
    expect(name).to_have_value("simulated_0")
    name.fill("left")
    name.press("Enter")  # by the keyboard
    expect(device).to_contain_text("Connected as left")
    expect(device.get_by_role("button", name="Disconnect simulated depth camera 1")).to_be_focused()
    expect(device.get_by_role("textbox")).to_have_count(0)
    page.keyboard.press("Escape")
    while not patient.get(f"{empty}/api/v1/status").json()["cameras"]["left"]["previews"]:
        page.wait_for_timeout(100)  # the tracker loads, however busy the machine is
    camera = page.locator(".camera")
    expect(camera.locator(".name")).to_contain_text("left")
    expect(camera.locator("img.preview")).to_be_visible()  # it delivers
    running = client_of("left")
    assert running
    camera.get_by_role("button", name="Disconnect left").click()
    expect(camera.locator(".health")).to_have_text("Disconnected")
    psutil.wait_procs(running)
    assert client_of("left") == [] and not any(one.is_running() for one in running)


def test_a_client_that_ends_is_told_and_connected_again(paper_sdks: Path, empty: str, page: Page) -> None:
    (paper_sdks / "pyorbbecsdk.py").unlink()  # the one that hangs
    open_page(page, empty)
    page.get_by_role("button", name="Other cameras").click()
    device = page.locator("#devices .device")
    expect(device.locator(".name")).to_have_text("Paper D435 A1234567")
    expect(device.locator(".look")).to_have_text("the RealSense gives no depth")
    device.get_by_role("button", name="Connect Paper D435").click()
    expect(device.locator(".now")).to_have_text("realsense_234567 has ended")
    expect(device.locator(".words")).to_contain_text("the RealSense gives no depth")
    expect(device.get_by_role("button", name="Connect Paper D435")).to_be_enabled()
    page.keyboard.press("Escape")
    told = page.locator(".ended")
    expect(told).to_contain_text("realsense_234567: the RealSense gives no depth")
    told.get_by_role("button", name="Connect again").click()
    expect(page.get_by_role("dialog", name="Add a camera")).to_be_visible()
    page.keyboard.press("Escape")
    told.get_by_role("button", name="Dismiss").click()
    expect(told).to_have_count(0)


def test_devices_fit_at_three_sizes_in_french(chromium: Browser, empty: str) -> None:
    context = chromium.new_context(viewport={"width": 1280, "height": 800}, locale="fr-FR")
    page = context.new_page()
    page.goto(empty)
    page.get_by_role("button", name="Autres caméras").click()
    device = page.locator("#simulated-devices .device").first
    expect(device.get_by_role("button", name="Connecter caméra de profondeur simulée 1")).to_be_visible()
    expect(page.get_by_role("dialog")).to_contain_text("Aucune caméra n'est branchée ici")
    for scheme, width in product(("dark", "light"), (1280, 800, 390)):
        page.emulate_media(color_scheme=scheme)
        page.set_viewport_size({"width": width, "height": 800})
        dialog = page.locator("#add-camera-dialog").bounding_box()
        for part in page.locator(".device, .device button, .device input, #devices-search").all():
            box = part.bounding_box()
            assert box and dialog and dialog["x"] <= box["x"], (scheme, width, box)
            assert box["x"] + box["width"] <= dialog["x"] + dialog["width"], (scheme, width, box)
    context.close()
