"""In a prepared process, everything that a solve calls is compiled."""

import json
import subprocess
import sys
from typing import Any

import pytest


@pytest.fixture(scope="module")
def told() -> dict[str, Any]:
    """What `ready` prints."""
    return json.loads(
        subprocess.run(
            [sys.executable, "-m", "tests.offline.ready"],
            capture_output=True, text=True, check=True, timeout=600,
        ).stdout
    )  # fmt: skip


def test_what_makes_a_process_ready_compiles_what_a_solve_calls(told):
    """Nothing is compiled a second time."""
    assert told["solved"] > 30, "it solved nothing"
    assert told["before"] and told["after_more"] == told["before"], "a solve compiled what was not ready"


def test_ordinary_cameras_and_hands_find_it_all_compiled(told):
    assert told["with_hands"] > 20, "hardly a hand was seen"
    assert told["before"] and told["after_hands"] == told["after_more"], "a solve compiled what was not ready"
