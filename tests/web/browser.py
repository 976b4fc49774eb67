"""A real Chromium with WebGL in software."""

import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from playwright.sync_api import Browser, ConsoleMessage, Page, sync_playwright

CHROMIUM = Path(next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), ""))
FLAGS = [
    "--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader",
    "--disable-background-networking", "--disable-component-update", "--disable-sync", "--no-first-run",
]  # fmt: skip


@contextmanager
def chromium_browser() -> Iterator[Browser]:
    """A browser while the block runs; a skip where there is no Chromium."""
    if not CHROMIUM.is_file():
        pytest.skip("no Chromium on this machine")
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=str(CHROMIUM), args=FLAGS)
        yield browser
        browser.close()


def _complains(message: ConsoleMessage) -> bool:
    """Whether the page complains; notes of the software renderer on its own speed are not the page's."""
    return (
        message.type in ("error", "warning") and "GL Driver Message (OpenGL, Performance" not in message.text
    )


@contextmanager
def quiet_page(browser: Browser) -> Iterator[Page]:
    """A page of 1280x720 that must not complain: errors and warnings on its console fail the test."""
    page = browser.new_page(viewport={"width": 1280, "height": 720})
    complaints: list[str] = []
    page.on("pageerror", lambda error: complaints.append(str(error)))
    page.on(
        "console",
        lambda message: (
            complaints.append(f"{message.text} {message.location['url']}") if _complains(message) else None
        ),
    )
    yield page
    page.close()
    assert not complaints, complaints
