"""The live output panel in a real browser: add a receiver, get its datagrams, switch it off."""

import socket

import pytest
from playwright.sync_api import expect

from tests.live.performer import save_stage_calibration
from tests.web.browser import quiet_page
from tests.web.servers import thread_server
from tests.web.test_page import NAMES, performing

pytestmark = pytest.mark.browser


def test_a_receiver_is_added_switched_off_and_removed(tmp_path, chromium):
    save_stage_calibration(tmp_path, NAMES)
    with (
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as receiver,
        thread_server(tmp_path) as server,
        quiet_page(chromium) as page,
        performing(server.url),
    ):
        receiver.bind(("127.0.0.1", 0))
        receiver.settimeout(120.0)
        page.goto(server.url)
        page.get_by_role("button", name="Live output").click()
        page.locator("#output-port").fill(str(receiver.getsockname()[1]))
        page.get_by_role("button", name="Add", exact=True).click()
        expect(page.locator("#outputs-count")).to_have_text("1 on")
        assert receiver.recv(4096).startswith(b"#bundle")
        page.locator("#outputs li input").uncheck()
        expect(page.locator("#outputs-count")).to_have_text("1 target")
        page.get_by_role("button", name="Remove VMC").click()
        expect(page.locator("#outputs-count")).to_have_text("0 targets")
