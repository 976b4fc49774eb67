"""Fixtures for all tests."""

import os
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import httpx
import pytest
from hypothesis import HealthCheck, settings
from websockets.sync.client import connect

if TYPE_CHECKING:
    from playwright.sync_api import Browser


REAL_TIME = (
    *(f"tests/{name}/" for name in ("acceptance", "web", "live")),
    "tests/engine/export/test_glb.py",
    "tests/security/test_page.py",
)
"""Tests with browsers and with programs that run in real time: they wait more than they compute."""

WAIT_S = 60.0


def pytest_configure() -> None:
    """Have clients wait a minute where a test does not say otherwise: a machine that is busy is slow, not wrong."""
    settings.register_profile("patient", deadline=None, suppress_health_check=[HealthCheck.too_slow])
    settings.load_profile("patient")
    for name in ("get", "post", "put", "patch", "delete", "request"):
        getattr(httpx, name).__kwdefaults__["timeout"] = httpx.Timeout(WAIT_S)
    httpx.Client.__init__.__kwdefaults__["timeout"] = httpx.Timeout(WAIT_S)
    connect.__kwdefaults__.update(open_timeout=WAIT_S, ping_timeout=WAIT_S)


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config: pytest.Config, log: object) -> object:
    """Keep the tests of a file in one process, and all that run in real time in one, beside those that compute."""
    from xdist.scheduler import LoadScopeScheduling

    class Scheduling(LoadScopeScheduling):
        def _split_scope(self, nodeid: str) -> str:
            return "real time" if nodeid.startswith(REAL_TIME) else nodeid.split("::")[0]

    return Scheduling(config, log)


@pytest.fixture(scope="session")
def test_data() -> Path:
    """The folder of outside recordings (`STUDIO_TEST_DATA`, default ../shared/data), or a skip."""
    folder = Path(os.environ.get("STUDIO_TEST_DATA", Path(__file__).parents[2] / "shared" / "data"))
    if not folder.is_dir():
        pytest.skip(f"no outside recordings at {folder}; set STUDIO_TEST_DATA")
    return folder


@pytest.fixture(scope="session")
def ready_worker() -> Iterator[None]:
    """A process that is kept ready for work, as a server's is: to load one for every work takes seconds."""
    from studio import worker

    worker.warm_up()
    yield
    worker.cool_down()


@pytest.fixture(scope="session")
def chromium() -> "Iterator[Browser]":
    """A real Chromium, one for all tests of a process: Playwright allows no second one beside it."""
    from tests.web.browser import chromium_browser

    with chromium_browser() as browser:
        yield browser


@pytest.fixture(scope="session")
def ready_pipeline() -> None:
    """This process is ready for its first pipeline: live stages begin theirs at once."""
    from studio.live.warmup import warm_up

    warm_up()
