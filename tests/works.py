"""Works that tests run in other processes. It imports little, because each of these processes loads it."""

import os
import sys
import time
from pathlib import Path
from typing import TYPE_CHECKING

from studio.engine.base.errors import SettingsError

if TYPE_CHECKING:
    from studio.take.folder.take import Take


def pid_and_square(number: int, *, progress) -> tuple[int, int]:
    progress(0.5)
    return os.getpid(), number**2


def loaded(module: str) -> tuple[bool, str]:
    return module in sys.modules, os.environ.get("STUDIO_TOLD_LATER", "")


def negative(number: int) -> int:
    return -number


def half_write(file: Path) -> None:
    try:
        file.touch()
        while True:
            time.sleep(0.01)
    finally:
        file.unlink()


def cling(file: Path) -> None:
    while True:
        try:
            file.touch()
            time.sleep(0.01)
        except BaseException:
            continue


def show_thrice(*, show, progress) -> str:
    for k in range(3):
        show([k] * 1000)
        progress(k / 3)
    return "done"


def refuse() -> None:
    raise SettingsError("no")


def count_for_ever(*, progress) -> None:
    while True:
        progress(0.1)
        time.sleep(0.01)


def finish_once_stopped(began: Path, stopped: Path, *, progress) -> str:
    began.touch()
    while not stopped.exists():
        time.sleep(0.01)
    progress(1.0)
    return "done"


def pid_once_there(file: Path) -> int:
    while not file.exists():
        time.sleep(0.01)
    return os.getpid()


def call_long_after(seconds: float) -> None:
    """From now on, work in this process counts as long once it has run for so many seconds."""
    from studio.worker import process

    process._SHORT_S = seconds


def compute_until_there(file: Path) -> int:
    while not file.exists():
        sum(range(1000))
    return os.getpid()


def tell_until_there(file: Path, *, progress) -> int:
    while not file.exists():
        progress(0.1)
        time.sleep(0.01)
    return os.getpid()


def niceness() -> int:
    return os.getpriority(os.PRIO_PROCESS, 0)


def crash() -> None:
    raise ZeroDivisionError("one over nothing")


def vanish() -> None:
    os._exit(7)


def notes_of(take: "Take") -> str:
    return take.meta["notes"]
