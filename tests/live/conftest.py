"""Live stages whose pipelines and works begin at once."""

import pytest


@pytest.fixture(scope="session", autouse=True)
def begins_quickly(ready_pipeline: None, ready_worker: None) -> None:
    """No test waits for code that each process loads once."""
