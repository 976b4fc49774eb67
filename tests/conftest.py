"""Fixtures for all tests."""

import gc
import os
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING

import pytest
from hypothesis import HealthCheck, settings

from studio.engine.base.system import lower_priority
from tests.camera.sdks import write_sdks
from tests.scheduling import NICENESS, REAL_TIME, Scheduling, begins_in_real_time, processes

if TYPE_CHECKING:
    from playwright.sync_api import Browser


class KeptBrowser:
    """One Chromium for all browser tests that follow each other."""

    def __init__(self) -> None:
        self._running = ExitStack()
        self._browser: Browser | None = None

    def open(self) -> "Browser":
        """Return the browser; start it where it is not open."""
        if self._browser is None:
            from tests.web.browser import chromium_browser

            self._browser = self._running.enter_context(chromium_browser())
        return self._browser

    def close(self) -> None:
        """End the browser, and Playwright's event loop, beside which a test can run none of its own."""
        self._browser = None
        self._running.close()


_kept_browser = KeptBrowser()

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


def pytest_collection_finish() -> None:
    """Collect garbage seldom, and leave out all modules and tests that are loaded: a collection of all that
    tests load takes a third of a second, and came every few seconds."""
    gc.collect()
    gc.freeze()
    gc.set_threshold(10_000, 20, 100)


def pytest_configure() -> None:
    """Let examples take their time, and tests that compute give way to those in real time."""
    worker = os.environ.get("PYTEST_XDIST_WORKER")
    if worker is not None and not begins_in_real_time(worker):
        lower_priority(NICENESS)
    settings.register_profile("patient", deadline=None, suppress_health_check=[HealthCheck.too_slow])
    settings.load_profile("patient")


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_auto_num_workers() -> int:
    """Run more processes than there are cores: many of them wait."""
    return processes()


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config: pytest.Config, log: object) -> object:
    """Keep the tests of a file in one process, and mix those that wait with those that compute."""
    return Scheduling(config, log)


def pytest_runtest_setup(item: pytest.Item) -> None:
    """Close the browser before tests of another kind."""
    if not item.nodeid.startswith(REAL_TIME):
        _kept_browser.close()


@pytest.hookimpl(trylast=True)
def pytest_sessionfinish() -> None:
    """Close the browser that the last test left."""
    _kept_browser.close()


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


@pytest.fixture(scope="module")
def chromium() -> "Browser":
    """A real Chromium, one for all browser tests that follow each other."""
    return _kept_browser.open()


@pytest.fixture(scope="session")
def ready_pipeline() -> None:
    """This process is ready for its first pipeline: live stages begin theirs at once."""
    from studio.live.warmup import warm_up

    warm_up()
