"""What a server does not need at its start is not loaded then: its start stays short."""

import subprocess
import sys
import time

import pytest

NOT_AT_THE_START = (
    "scipy.signal",
    "scipy.stats",
    "ezc3d",
    "pygltflib",
    "av",
    "rosbags",
    "distributed",
    "mediapipe",
    "ufbx",
    "pxr",
)
READY_S = 3.0


def test_what_the_server_loads():
    code = f"import sys, studio.api.server; print([n for n in {NOT_AT_THE_START!r} if n in sys.modules])"
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, timeout=120, check=True
    )
    assert done.stdout.strip() == "[]"


@pytest.mark.long
def test_ready_within_three_seconds(tmp_path):
    """On an idle machine, from the command to the line that says where it is open, files in the system's memory."""
    command = [sys.executable, "-m", "studio", "serve", "--port", "0", "--sessions", str(tmp_path)]
    times = []
    for _ in range(4):
        start = time.perf_counter()
        with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as program:
            assert "is open on" in program.stdout.readline()
            times.append(time.perf_counter() - start)
            program.terminate()
            program.wait(timeout=30)
    assert min(times) <= READY_S, times
