"""The live output panel in a real browser: add a receiver, get its datagrams, switch it off."""

import socket

import pytest
from playwright.sync_api import expect

from tests.acceptance.program import studio_program
from tests.web.browser import quiet_page

pytestmark = pytest.mark.browser


def test_a_receiver_is_added_switched_off_and_removed(tmp_path, chromium):
    with (
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as receiver,
        studio_program(tmp_path) as host,
        quiet_page(chromium) as page,
    ):
        receiver.bind(("127.0.0.1", 0))
        receiver.settimeout(120.0)
        page.goto(f"http://{host}/")
        page.get_by_role("button", name="Live output").click()
        page.locator("#output-port").fill(str(receiver.getsockname()[1]))
        page.get_by_role("button", name="Add", exact=True).click()
        expect(page.locator("#outputs-count")).to_have_text("1 on")
        assert receiver.recv(4096).startswith(b"#bundle")
        page.locator("#outputs li input").uncheck()
        expect(page.locator("#outputs-count")).to_have_text("1 target")
        page.get_by_role("button", name="Remove VMC").click()
        expect(page.locator("#outputs-count")).to_have_text("0 targets")
