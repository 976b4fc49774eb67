"""Fixtures for all tests."""

import os
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import pytest
from hypothesis import HealthCheck, settings

from tests.camera.sdks import write_sdks

if TYPE_CHECKING:
    from playwright.sync_api import Browser


REAL_TIME = (
    *(f"tests/{name}/" for name in ("acceptance", "web", "live")),
    "tests/engine/animation/export/test_glb.py",
    "tests/security/test_page.py",
)
"""Tests with browsers and with programs that run in real time: they wait more than they compute."""

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
    """Keep what is fast, where only that is wanted."""
    if config.getoption("--fast"):
        kept = [one for one in items if one.nodeid.startswith(FAST) and not one.get_closest_marker("browser")]
        config.hook.pytest_deselected(items=[one for one in items if one not in kept])
        items[:] = kept


def pytest_configure() -> None:
    """Let examples take their time."""
    settings.register_profile("patient", deadline=None, suppress_health_check=[HealthCheck.too_slow])
    settings.load_profile("patient")


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


@pytest.fixture
def paper_sdks(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with libraries of devices made of paper, which all processes that a test starts find first."""
    folder = tmp_path / "sdks"
    write_sdks(folder)
    monkeypatch.setenv("PYTHONPATH", str(folder), prepend=os.pathsep)
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
