"""Fixtures for all tests."""

import os
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

if TYPE_CHECKING:
    from playwright.sync_api import Browser


TESTS = Path(__file__).parent
REAL_TIME = (
    "acceptance",
    "api",
    "web",
    "live",
)  # servers, browsers, cameras: they wait more than they compute


@pytest.hookimpl(tryfirst=True)  # before pytest-xdist reads the groups
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Keep the tests of a file in one process, and all that run in real time in one, beside those that compute."""
    for item in items:
        file = item.path.relative_to(TESTS)
        group = "real time" if file.parts[0] in REAL_TIME else str(file)
        item.add_marker(pytest.mark.xdist_group(group))
    items.sort(key=lambda item: item.path.relative_to(TESTS).parts[0] not in REAL_TIME)


@pytest.fixture(scope="session")
def test_data() -> Path:
    """The folder of outside recordings (`STUDIO_TEST_DATA`, default ../shared/data), or a skip."""
    folder = Path(os.environ.get("STUDIO_TEST_DATA", Path(__file__).parents[2] / "shared" / "data"))
    if not folder.is_dir():
        pytest.skip(f"no outside recordings at {folder}; set STUDIO_TEST_DATA")
    return folder


@pytest.fixture(scope="session")
def chromium() -> "Iterator[Browser]":
    """A real Chromium, one for all tests of a process: Playwright allows no second one beside it."""
    from tests.web.browser import chromium_browser

    with chromium_browser() as browser:
        yield browser
