"""Robots from the page: a folder is dropped, the robot is looked at, corrected, and removed with a way back."""

import shutil
from pathlib import Path

import pytest
from playwright.sync_api import Browser, expect

from tests.engine.robots import models
from tests.web.axe import found_in
from tests.web.browser import quiet_page
from tests.web.servers import thread_server
from tests.web.test_import_page import drop

pytestmark = [pytest.mark.browser, pytest.mark.viewing, pytest.mark.timeout(600)]


def test_a_robot_is_dropped_corrected_removed_and_comes_back(tmp_path: Path, chromium: Browser) -> None:
    robot = tmp_path / "robot"
    robot.mkdir()
    models.written(robot, models.child(), "child.xml")
    with thread_server(tmp_path / "sessions") as server, quiet_page(chromium) as page:
        page.goto(server.url)
        expect(page.locator("#preset")).to_be_visible()
        drop(page, "#viewer", robot)
        expect(page.locator(".message", has_text="child")).to_be_visible()
        shutil.rmtree(robot)
        page.locator("#view-layers summary").click()
        page.locator("#robot-child").click()
        page.locator("#robot-open").click()
        part = page.locator("#robot-part-head")
        expect(part).to_be_visible()
        other = "l_s_yaw1"
        part.select_option(other)
        expect(page.locator(".message", has_text="corrected")).to_be_visible()
        expect(part).to_have_value(other)
        assert found_in(page, "robot") == []
        page.locator("#robot-remove").click()
        expect(page.locator("#robot-dialog")).to_be_hidden()
        expect(page.locator("#robot-child")).to_have_count(0)
        page.locator(".message", has_text="removed").get_by_role("button", name="Undo").click()
        page.locator("#view-layers summary").click()
        page.locator("#robot-child").click()
        expect(page.locator("#robot-open")).to_be_visible()
        assert server.http.get("/robots/child").json()["parts"]["head"] == other
        assert server.http.get("/view").json()["robot"] == "child"
        lost = server.http.post(
            "/imports", json={"files": [{"path": "bad/bad.urdf", "size": 4}]}
        ).raise_for_status()
        (announced,) = lost.json()["imports"]
        assert announced["robot"]
        server.http.put(f"/imports/{announced['job']['id']}", content=b"<no>").raise_for_status()
        page.locator("#work-button").click()
        expect(page.locator(".work-row.failed")).to_contain_text("bad has no robot's model")
