"""Processes of the studio start no other processes to load what they need."""

import os
import subprocess
import sys

import pytest


@pytest.mark.parametrize("program", [["-m", "studio", "doctor"], ["-c", "import studio.worker.loaded"]])
def test_mujoco_is_loaded_without_windows(program: list[str]) -> None:
    environment = {name: value for name, value in os.environ.items() if name != "MUJOCO_GL"}
    loads = [sys.executable, "-X", "importtime", *program]
    done = subprocess.run(loads, env=environment, capture_output=True, text=True, check=False)
    assert "mujoco.rendering" in done.stderr and "glfw" not in done.stderr
