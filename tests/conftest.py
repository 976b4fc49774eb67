"""Fixtures for all tests."""

import os
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import pytest
from hypothesis import HealthCheck, settings

if TYPE_CHECKING:
    from playwright.sync_api import Browser


BROWSER = (
    "tests/acceptance/test_first_light_browser.py",
    "tests/engine/animation/export/test_glb.py",
    "tests/security/test_page.py",
    "tests/web/",
)
REAL_TIME = ("tests/acceptance/", "tests/live/")
"""Tests with browsers, and with programs that run in real time: they wait more than they compute."""

FAST = (
    *(f"tests/engine/{name}/" for name in ("base", "model", "metrics")),
    *(f"tests/{name}/" for name in ("streams", "take")),
    *(f"tests/test_{name}.py" for name in ("config", "lock", "systems", "wire", "worker")),
)
"""The part of `--fast`: no browser, nothing to install beside Python's packages."""


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption(
        "--fast", action="store_true", help="only tests that need no browser and no other programs"
    )


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Begin with the longest, so that no process is left alone with it; keep only what is fast, if wanted."""
    items.sort(key=lambda item: _place(item.nodeid))
    if config.getoption("--fast"):
        kept = [one for one in items if one.nodeid.startswith(FAST) and not one.get_closest_marker("browser")]
        config.hook.pytest_deselected(items=[one for one in items if one not in kept])
        items[:] = kept


def _place(nodeid: str) -> int:
    """Where a test stands: browsers, programs in real time, whole programs and guards, all others."""
    if nodeid.startswith(BROWSER):
        return 0
    if nodeid.startswith(REAL_TIME):
        return 1
    return 2 if nodeid.startswith("tests/test_") else 3


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_auto_num_workers() -> int:
    """One process more than processors (`-n auto`): tests in real time wait more than they compute."""
    return (os.cpu_count() or 1) + 1


def pytest_configure() -> None:
    """Let examples take their time."""
    settings.register_profile("patient", deadline=None, suppress_health_check=[HealthCheck.too_slow])
    settings.load_profile("patient")


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config: pytest.Config, log: object) -> object:
    """Keep the tests of a file in one process; all with browsers in one, all others in real time in another."""
    from xdist.scheduler import LoadScopeScheduling

    class Scheduling(LoadScopeScheduling):
        def _split_scope(self, nodeid: str) -> str:
            return ("browser", "real time", *2 * (nodeid.split("::")[0],))[_place(nodeid)]

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
