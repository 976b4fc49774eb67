"""Runs the program, as a user does."""

import io
import os
import subprocess
import sys
from contextlib import chdir, redirect_stderr, redirect_stdout
from pathlib import Path
from unittest.mock import patch

from studio.__main__ import main


def studio(*arguments: str | Path, cwd: Path) -> subprocess.CompletedProcess[str]:
    """Return what `studio ...` did in this process: exit code, standard output and standard error."""
    out, errors = io.StringIO(), io.StringIO()
    words = [str(one) for one in arguments]
    with (
        chdir(cwd), redirect_stdout(out), redirect_stderr(errors), patch.dict(os.environ, {"COLUMNS": "100"})
    ):  # fmt: skip
        try:
            code = main(words)
        except SystemExit as left:  # wrong use, --help
            code = int(left.code or 0)
    return subprocess.CompletedProcess(words, code, out.getvalue(), errors.getvalue())


def studio_process(*arguments: str | Path, cwd: Path) -> subprocess.CompletedProcess[str]:
    """Return the same of a process of its own; it takes seconds to load what it needs."""
    return subprocess.run(
        [sys.executable, "-W", "error::ResourceWarning", "-m", "studio", *map(str, arguments)],
        cwd=cwd,
        env={**os.environ, "PYTHONPATH": str(Path(__file__).parents[2]), "COLUMNS": "100"},
        capture_output=True,
        text=True,
        timeout=300,
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
