"""A joint of the replayed character is chosen by a click in the 3D view, and by the keyboard."""

import re

import numpy as np
import pytest
from playwright.sync_api import Page, expect

from tests import patient
from tests.web.browser import until
from tests.web.playback.test_framed import address

pytestmark = [pytest.mark.browser, pytest.mark.moving]
__all__ = ["address"]


def wait_for_place(page: Page, place: str) -> None:
    until(page, f"JSON.parse(sessionStorage.getItem('viewpoint') ?? '{{}}').place === '{place}'")


def pixel(page: Page, point_m: list[float]) -> tuple[float, float]:
    """Where on the page a point of the stage is seen: the view's angle is 37 degrees of its height."""
    wait_for_place(page, "front")
    look = page.evaluate("JSON.parse(sessionStorage.getItem('viewpoint')).look")
    eye, target = np.array(look["position"]), np.array(look["target"])
    forward = (target - eye) / np.linalg.norm(target - eye)
    right = np.cross(forward, [0.0, 0.0, 1.0])
    right /= np.linalg.norm(right)
    x, y, depth = np.array([right, np.cross(forward, right), forward]) @ (np.array(point_m) - eye)
    box = page.locator("#viewer").bounding_box()
    assert box is not None
    scale = box["height"] / (2.0 * np.tan(np.radians(37.0) / 2.0) * depth)
    return box["x"] + box["width"] / 2 + x * scale, box["y"] + box["height"] / 2 + y * scale


def test_a_joint_is_chosen_by_a_click_and_by_keys(address: str, page: Page) -> None:
    page.goto(address)
    page.get_by_role("button", name="Replay walk, solve studio").click()
    joint, legend = page.locator("#replay-joint"), page.locator("#curve-legend li")
    expect(joint).to_have_value("LeftHand")
    expect(page.locator("#replay-value")).to_contain_text("m")
    expect(page.frame_locator("#viewer").locator("canvas[data-engine]")).to_be_visible()
    wait_for_place(page, "motion")  # the view frames what is opened
    page.locator("#view-front").click()
    places = patient.get(f"{address}/api/v1/replay/joints", params={"frame": 0}).json()["positions_m"]
    head = pixel(page, places["Head"])
    page.mouse.click(head[0] + 6, head[1] - 6)
    expect(joint).to_have_value("Head")
    expect(page.locator("#joint-name")).to_have_text("Head")
    expect(legend).to_have_count(0)
    page.mouse.click(*pixel(page, places["RightForeArm"]))
    expect(joint).to_have_value("RightForeArm")
    page.keyboard.down("Shift")
    page.mouse.click(*head)
    page.keyboard.up("Shift")
    expect(legend).to_have_count(3)
    expect(legend.first).to_contain_text("Head Position X")
    page.mouse.click(head[0] + 120, head[1])  # where nobody is
    page.mouse.click(*pixel(page, places["LeftHandMiddle3"]))
    expect(joint).to_have_value(re.compile("LeftHand(Index|Middle|Ring|Pinky)3"))  # by itself not in the list
    page.locator("#replay-joint").select_option("Head")
    page.keyboard.press("j")
    expect(joint).to_have_value("LeftArm")
    page.keyboard.press("Shift+J")
    page.keyboard.press("Shift+J")
    expect(joint).to_have_value("Spine2")
    page.keyboard.press("Shift+C")
    expect(legend).to_have_count(6)
    page.keyboard.press("Shift+C")
    expect(legend).to_have_count(3)


def test_the_places_of_joints_are_told(address: str) -> None:
    patient.put(f"{address}/api/v1/replay", json={"take": "monday/walk", "solve": "studio"})
    joints = f"{address}/api/v1/replay/joints"
    first, last, beyond = (
        patient.get(joints, params={"frame": frame}).json()["positions_m"]["Hips"] for frame in (0, 120, 999)
    )
    assert first == [-1.0, 0.5, 0.94] and last == beyond == [1.0, 0.5, 0.94]
