"""A process that does work: its messages to the server, and the end of work that should stop."""

import contextlib
import importlib
import math
import multiprocessing
import os
import signal
import threading
import time
import traceback
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess
from typing import Any

from studio.engine.base.errors import StudioError
from studio.engine.base.system import leave_out_windows, lower_priority, peak_memory_bytes

NICENESS = 10
"""Niceness of background work, because recording and the live stage have priority."""

_SHORT_S = 4.0
"""Work with less computing time keeps its priority, because a user waits for it. Elapsed time would not do: on a
busy machine short work takes long.
"""

_LARGEST_BYTES = 800 * 1024**2
"""A process that has used more memory is not kept."""

_LOOK_AT_WORK_S = 0.5
"""Interval of a process's checks of its computing time."""

_INTERRUPTION: int | None = getattr(signal, "SIGUSR1", None)
"""The signal that interrupts work; None if the system has none that a process can handle."""

_at_work = False
"""Whether this process runs work that may be interrupted."""


class _Leave(BaseException):
    """Raised inside work that should stop; ordinary handlers do not catch it."""


def interrupt(process: BaseProcess) -> bool:
    """Interrupt a process's work at once; return whether the system can do this."""
    if _INTERRUPTION is None or process.pid is None:
        return False
    with contextlib.suppress(ProcessLookupError):
        os.kill(process.pid, _INTERRUPTION)
    return True


def _leave(*_: object) -> None:
    if _at_work:
        raise _Leave


def _may_have_children() -> None:
    """Let the work start processes, which a process that ends with the server may not; they end with it."""
    config: dict[str, Any] = vars(multiprocessing.current_process())["_config"]
    config["daemon"] = False


def work(connection: Connection, loaded: bool, gives_way: bool | None, environment: dict[str, str]) -> None:
    """Run work until the server closes the connection.

    Args:
        loaded: first load the code of a solve.
        gives_way: from the start; False: once work has computed for long; None: never.
        environment: the server's; a copied process has the one from the server's start.
    """
    os.environ.clear()
    os.environ.update(environment)
    leave_out_windows()
    _may_have_children()
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for the server, which ends its workers
    if _INTERRUPTION is not None:
        signal.signal(_INTERRUPTION, _leave)
    if gives_way:
        lower_priority(NICENESS)
    speaks = threading.Lock()

    def tell(kind: str, value: Any, stays: bool) -> None:
        with speaks:
            connection.send((kind, value, stays))

    if loaded:
        importlib.import_module("studio.worker.loaded")
    while True:
        try:
            wanted = connection.recv()
        except (EOFError, ConnectionResetError):
            return  # the server has ended, or no longer needs this process
        if wanted is None:
            continue  # a request to stop that came after the end
        try:
            with _giving_way(tell, gives_way is not None) as gave_way:
                kind, value, stays = _answer(connection, tell, *wanted)
            tell(kind, value, stays and not gave_way.is_set())
        except BrokenPipeError:
            return  # the server has ended


@contextmanager
def _giving_way(tell: Callable[[str, Any, bool], None], may: bool) -> Iterator[threading.Event]:
    """Report when the work in the block has computed for long, and lower this process's priority for good; the event
    is set then.
    """
    done, gave_way = threading.Event(), threading.Event()
    until_s = time.process_time() + (_SHORT_S if may else math.inf)

    def watch() -> None:
        while not done.wait(_LOOK_AT_WORK_S):
            if time.process_time() > until_s:
                gave_way.set()
                lower_priority(NICENESS)
                with contextlib.suppress(BrokenPipeError):  # the server has ended, as the work will find
                    tell("long", None, False)
                return

    watching = threading.Thread(target=watch, daemon=True)
    watching.start()
    try:
        yield gave_way
    finally:
        done.set()
        watching.join()


def _answer(
    connection: Connection, tell: Callable[[str, Any, bool], None], text: str, tells: bool, shows: bool
) -> tuple[str, Any, bool]:
    """Run work, whose arguments come next; return its state, its result, and whether this process can be used
    again.
    """

    global _at_work
    heard = False

    def progress(share: float) -> None:
        nonlocal heard
        if share < 1.0 and connection.poll():  # what is done stays done
            connection.recv()
            heard = True
            raise _Leave
        tell("progress", float(share), True)

    try:
        args, kwargs = connection.recv()
        module, _, name = text.partition(":")
        function = getattr(importlib.import_module(module), name)
        _at_work = True
        try:
            told = {"progress": progress} if tells else {}
            shown = {"show": lambda part: tell("part", part, True)} if shows else {}
            value = function(*args, **kwargs, **told, **shown)
        finally:
            _at_work = False
    except _Leave:
        return "stopped", None, heard
    except StudioError as error:
        return "error", error, True
    except BrokenPipeError:
        raise  # the server has ended
    except Exception:  # boundary of the process: the server logs it
        return "crash", traceback.format_exc(), False
    return "done", value, peak_memory_bytes() < _LARGEST_BYTES
