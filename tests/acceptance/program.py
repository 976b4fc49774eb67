"""The real program, started as a user starts it."""

import signal
import subprocess
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path


@contextmanager
def studio_program(sessions: Path, words: Sequence[str] = ("serve", "--demo")) -> Iterator[str]:
    """`studio` with these words while the block runs; yields its host and port. Ends with Ctrl-C, as a user would."""
    command = [sys.executable, "-m", "studio", *words, "--port", "0", "--sessions", str(sessions)]
    with (
        (sessions.parent / "serve.log").open("w") as log,
        subprocess.Popen(command, stdout=subprocess.PIPE, stderr=log, text=True) as program,
    ):
        assert program.stdout is not None
        line = program.stdout.readline()
        assert "http://" in line, (sessions.parent / "serve.log").read_text()
        try:
            yield line.split("http://")[1].split()[0]
        finally:
            program.send_signal(signal.SIGINT)
            assert program.wait(timeout=60) == 0
