"""The set panel in a real browser: timecode beside the recording, triggers switched on, and what they heard."""

import re
import socket

import pytest
from playwright.sync_api import expect

from studio.engine.rigid_bodies.known import KnownBody, TakeBodies, Tie
from studio.take.folder.take import Take
from studio.take.rigid_bodies.kept import save_take_bodies
from tests.rigid_bodies.test_packets import message
from tests.triggers.test_packets import osc
from tests.web.browser import quiet_page
from tests.web.servers import thread_server

pytestmark = pytest.mark.browser


def test_timecode_is_shown_and_a_trigger_is_heard(tmp_path, chromium):
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as channel:
        channel.bind(("127.0.0.1", 0))
        port = channel.getsockname()[1]
    with (
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as desk,
        thread_server(tmp_path) as server,
        quiet_page(chromium) as page,
    ):
        page.goto(server.url)
        page.get_by_role("button", name="On set").click()
        expect(page.locator("#timecode")).to_be_hidden()
        page.locator("#timecode-rate").select_option("25")
        page.locator("#timecode-source").fill("clock")
        page.locator("#timecode-source").press("Enter")
        page.locator("#set-title-fold").focus()
        expect(page.locator("#timecode")).to_have_text(re.compile(r"^\d\d:\d\d:\d\d:\d\d$"))
        expect(page.locator("#timecode-state")).to_contain_text("Timecode comes in")
        expect(page.locator("#set-count")).to_contain_text("clock")
        page.locator("#trigger-osc_port").fill(str(port))
        page.locator("#trigger-osc").check()
        expect(page.locator("#set-count")).to_contain_text("1 trigger on")
        desk.settimeout(60.0)
        desk.sendto(osc("/record/state").dgram, ("127.0.0.1", port))
        assert b"idle" in desk.recv(4096)
        expect(page.locator("#set")).to_contain_text("state (127.0.0.1)")
        page.locator("#trigger-osc").uncheck()
        expect(page.locator("#set-count")).not_to_contain_text("trigger")

        page.locator("#rigid-osc_port").fill(str(port))  # the same port, for trackers now
        page.locator("#rigid-osc").check()
        expect(page.locator("#rigid")).to_contain_text("Nothing heard yet")
        place = message("/tracking/trackers/1/position", 0.1, 1.2, 0.3).build().dgram
        desk.sendto(place, ("127.0.0.1", port))
        expect(page.locator("#rigid")).to_contain_text("tracker 1")
        page.get_by_label("Shape of tracker 1").fill("cylinder:3,60")
        page.get_by_label("Shape of tracker 1").press("Enter")
        page.locator("#set-title-fold").focus()
        expect(page.get_by_label("Use of tracker 1")).to_have_value("prop")
        expect(page.locator("#rigid")).to_contain_text("tied to the hand that holds it")
        page.get_by_label("Joint of tracker 1").select_option("head")
        page.locator("#set-title-fold").focus()
        expect(page.get_by_label("Use of tracker 1")).to_contain_text("evidence")
        expect(page.locator("#rigid")).to_contain_text("rigid bodies come in")

        # as evidence, as it was measured in a take
        expect(page.locator("#rigid-like")).to_contain_text("no take was measured")
        page.get_by_label("Use of tracker 1").select_option("evidence")
        page.locator("#set-title-fold").focus()
        expect(page.locator("#rigid")).to_contain_text("pins nothing live")
        take = Take.create(tmp_path / "monday" / "range", session="monday", name="range", source="live")
        known = KnownBody("tracker 1", use="evidence", joint="right_wrist")
        save_take_bodies(take, TakeBodies(bodies=(known,), ties={"tracker 1": Tie((0.0, 0.0, 0.1), 12.3)}))
        page.locator("#set-title").hover()
        page.locator("#rigid h3").hover()
        page.locator("#rigid-like").select_option("monday/range")
        expect(page.locator("#rigid")).to_contain_text("pins right wrist live; measured to 12 mm")
