"""What a person at a terminal sees: a progress bar there and nowhere else, and a quiet end on Ctrl-C."""

import fcntl
import os
import pty
import signal
import struct
import subprocess
import sys
import termios
import time

import psutil

from studio.__main__ import main
from studio.commands.common import progress_bar

WORK = """
import time
from studio.commands.common import progress_bar
with progress_bar("solve") as progress:
    for k in range(1, 17):
        time.sleep(0.1)
        if progress is not None:
            progress(k / 16)
"""


def test_no_bar_where_there_is_no_terminal(capsys):
    with progress_bar("solve") as progress:
        assert progress is None
    assert capsys.readouterr().err == ""


def test_a_bar_on_a_terminal():
    ours, theirs = pty.openpty()
    fcntl.ioctl(theirs, termios.TIOCSWINSZ, struct.pack("HHHH", 24, 80, 0, 0))
    done = subprocess.run([sys.executable, "-c", WORK], stdout=theirs, stderr=theirs, check=True, timeout=180)
    os.close(theirs)
    seen = os.read(ours, 100_000).decode()
    os.close(ours)
    assert done.returncode == 0
    assert "solve" in seen
    assert "%|" in seen
    assert " 0%|" not in seen  # nothing for the first second


def interrupted(process: subprocess.Popen[str]) -> tuple[str, str]:
    """Press Ctrl-C until the program ends: what is being compiled at that moment does not hear it."""
    for _ in range(10):
        process.send_signal(signal.SIGINT)
        try:
            return process.communicate(timeout=10)
        except subprocess.TimeoutExpired:
            continue
    return process.communicate(timeout=1)


def test_ctrl_c_is_quiet_while_the_commands_are_loaded(monkeypatch, capsys):
    def pressed() -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("studio.__main__.make_parser", pressed)
    assert main(["bench"]) == 130
    assert capsys.readouterr() == ("", "")


def test_ctrl_c_is_quiet(tmp_path):
    process = subprocess.Popen(
        [sys.executable, "-m", "studio", "bench", "--frames", "100000"],
        cwd=tmp_path,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),  # a job in the background ignores it
    )
    try:
        while psutil.Process(process.pid).cpu_times().user < 1.0:  # it is at work
            assert process.poll() is None
            time.sleep(0.1)
        out, errors = interrupted(process)
    finally:
        process.kill()
    assert process.returncode == 130
    assert (out, errors) == ("", "")
