"""Live stages whose pipelines begin at once."""

import pytest


@pytest.fixture(scope="session", autouse=True)
def begins_quickly(ready_pipeline: None) -> None:
    """No test waits for what a process loads once."""
