"""Fixtures for all tests."""

import os
from pathlib import Path

import pytest


@pytest.fixture(scope="session")
def test_data() -> Path:
    """The folder of outside recordings (`STUDIO_TEST_DATA`, default ../shared/data), or a skip."""
    folder = Path(os.environ.get("STUDIO_TEST_DATA", Path(__file__).parents[2] / "shared" / "data"))
    if not folder.is_dir():
        pytest.skip(f"no outside recordings at {folder}; set STUDIO_TEST_DATA")
    return folder
