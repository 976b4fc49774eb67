"""A process that was made ready finds all that ordinary cameras need compiled."""

import json
import subprocess
import sys


def test_ordinary_cameras_and_hands_find_it_all_compiled():
    printed = subprocess.run(
        [sys.executable, "-m", "tests.offline.ready"],
        capture_output=True, text=True, check=True, timeout=600,
    ).stdout  # fmt: skip
    with_hands, before, after = json.loads(printed)
    assert with_hands > 20, "hardly a hand was seen"
    assert before and after == before, "a solve compiled what was not ready"
