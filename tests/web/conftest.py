"""A view on a server, and a real Chromium with WebGL in software."""

from collections.abc import Iterator
from pathlib import Path

import pytest
from fastapi import FastAPI
from fastapi.responses import JSONResponse
from playwright.sync_api import Browser, Page

from studio.api.jobs import Jobs
from studio.engine.base.errors import StudioError
from studio.web import ViewHandle, mount
from tests.web.browser import View, quiet_page, views_that_are
from tests.web.stages import FakeStage, FolderOfTakes, serving


@pytest.fixture(scope="session", autouse=True)
def works_quickly(ready_worker: None) -> None:
    """Work of the server finds a process that is ready."""


@pytest.fixture(autouse=True)
def view_as_marked(request: pytest.FixtureRequest) -> Iterator[None]:
    """The 3D view does no more than the test's marks ask for."""
    views: dict[str, View] = {"lively": "drawn", "moving": "moving", "viewing": "still"}
    marked = (view for mark, view in views.items() if request.node.get_closest_marker(mark) is not None)
    with views_that_are(next(marked, "absent")):
        yield


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

    app.state.events = {}
    view = mount(app, stage, sessions=tmp_path, takes=FolderOfTakes(tmp_path), jobs=Jobs())
    yield view, app
    view.close()


@pytest.fixture
def address(handle: tuple[ViewHandle, FastAPI]) -> Iterator[str]:
    """Address of a server with the view."""
    with serving(handle[1]) as url:
        yield url


@pytest.fixture
def page(chromium: Browser) -> Iterator[Page]:
    """A page that must not complain on its console."""
    with quiet_page(chromium) as tab:
        yield tab
