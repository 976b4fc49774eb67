"""`python -m tests.web.picture OUT.png`: the studio's page over its simulated stage, as the README shows it.

Starts the real program on a free port, waits for the calibration of the simulated stage, and takes a picture.
"""

import sys
import tempfile
from pathlib import Path

from playwright.sync_api import expect

from tests.acceptance.program import studio_program
from tests.web.browser import chromium_browser, quiet_page

CALIBRATED_MS = 150_000
PUNCHES_MS = 12_000


def take_picture(out: Path) -> None:
    """Write the picture."""
    with tempfile.TemporaryDirectory() as folder:
        sessions = Path(folder) / "sessions"
        sessions.mkdir()
        with studio_program(sessions) as host, chromium_browser() as browser, quiet_page(browser) as page:
            page.goto(f"http://{host}/")
            expect(page.locator("#calibration-badge")).to_have_text("good", timeout=CALIBRATED_MS)
            page.locator("#record").click()
            page.wait_for_timeout(PUNCHES_MS)
            page.screenshot(path=out)


if __name__ == "__main__":
    take_picture(Path(sys.argv[1]))
