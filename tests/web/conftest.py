"""A view on a server, and a real Chromium with WebGL in software."""

from collections.abc import Iterator
from pathlib import Path

import pytest
from fastapi import FastAPI
from fastapi.responses import JSONResponse
from playwright.sync_api import Browser, Page, sync_playwright

from studio.engine.errors import StudioError
from studio.web import ViewHandle, mount
from tests.web.stages import FakeStage, serving

CHROMIUM = Path("/usr/bin/chromium")
FLAGS = [
    "--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader",
    "--disable-background-networking", "--disable-component-update", "--disable-sync", "--no-first-run",
]  # fmt: skip


@pytest.fixture
def stage() -> FakeStage:
    return FakeStage()


@pytest.fixture
def handle(stage: FakeStage, tmp_path: Path) -> Iterator[tuple[ViewHandle, FastAPI]]:
    """The view mounted on an app."""
    app = FastAPI()

    @app.exception_handler(StudioError)
    async def say(_: object, error: StudioError) -> JSONResponse:
        return JSONResponse({"detail": str(error)}, status_code=400)

    view = mount(app, stage, sessions=tmp_path)
    yield view, app
    view.close()


@pytest.fixture
def address(handle: tuple[ViewHandle, FastAPI]) -> Iterator[str]:
    """Address of a server with the view."""
    with serving(handle[1]) as url:
        yield url


@pytest.fixture(scope="session")
def chromium() -> Iterator[Browser]:
    if not CHROMIUM.exists():
        pytest.skip(f"no Chromium at {CHROMIUM}")
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=str(CHROMIUM), args=FLAGS)
        yield browser
        browser.close()


@pytest.fixture
def page(chromium: Browser) -> Iterator[Page]:
    """A page that must not complain: errors and warnings on its console fail the test."""
    tab = chromium.new_page(viewport={"width": 1280, "height": 720})
    complaints: list[str] = []
    tab.on("pageerror", lambda error: complaints.append(str(error)))
    tab.on(
        "console",
        lambda message: complaints.append(message.text) if message.type in ("error", "warning") else None,
    )
    yield tab
    tab.close()
    assert complaints == []
