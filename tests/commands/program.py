"""Runs the real program, as a user does."""

import os
import subprocess
import sys
from pathlib import Path


def studio(*arguments: str | Path, cwd: Path, timeout_s: float = 120.0) -> subprocess.CompletedProcess[str]:
    """Return what `studio ...` did: exit code, standard output and standard error."""
    return subprocess.run(
        [sys.executable, "-W", "error::ResourceWarning", "-m", "studio", *map(str, arguments)],
        cwd=cwd,
        env={**os.environ, "PYTHONPATH": str(Path(__file__).parents[2]), "COLUMNS": "100"},
        capture_output=True,
        text=True,
        timeout=timeout_s,
        check=False,
        stdin=subprocess.DEVNULL,
    )


def one_line(done: subprocess.CompletedProcess[str], code: int) -> str:
    """Return the one line of standard error of a command that failed with this exit code."""
    assert done.returncode == code, done.stderr
    lines = done.stderr.splitlines()
    assert len(lines) == 1, done.stderr
    assert lines[0].startswith("studio ")
    return lines[0]
