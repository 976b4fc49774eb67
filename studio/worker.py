"""Work in a process of its own, so that neither the live stage nor the server waits for it.

A process takes seconds to load what a solve needs. `warm_up` has one load it before there is work; the next work goes
to it, and another one takes its place.
"""

import importlib
import logging
import multiprocessing
import os
import signal
import threading
import traceback
from collections.abc import Callable
from dataclasses import dataclass
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess
from typing import Any

from studio.engine.errors import StudioError

_log = logging.getLogger(__name__)

_NICENESS = 10
"""Recording and the live stage come first where cores are short."""

_PRELOADED = ("studio.replay", "studio.engine.export")


@dataclass
class _Worker:
    process: BaseProcess
    connection: Connection


_lock = threading.Lock()
_spare: _Worker | None = None
_warm = False


def warm_up() -> None:
    """Keep a process ready from now on; returns at once."""
    global _warm
    with _lock:
        _warm = True
    _replace_spare()


def cool_down() -> None:
    """Keep none ready any more."""
    global _warm, _spare
    with _lock:
        _warm, spare, _spare = False, _spare, None
    if spare is not None:
        spare.process.terminate()
        spare.process.join()
        spare.connection.close()


def _replace_spare() -> None:
    global _spare
    with _lock:
        if _warm and _spare is None:
            _spare = _start(_PRELOADED)


def _start(preloaded: tuple[str, ...] = ()) -> _Worker:
    context = multiprocessing.get_context("spawn")
    here, there = context.Pipe()
    process = context.Process(target=_work, args=(there, preloaded), daemon=True)
    process.start()
    there.close()
    return _Worker(process, here)


def _take() -> _Worker:
    global _spare
    with _lock:
        worker, _spare = _spare, None
    return worker if worker is not None and worker.process.is_alive() else _start()


def run_in_process(
    function: Callable[..., Any],
    *args: Any,
    on_progress: Callable[[float], None] | None = None,
    **kwargs: Any,
) -> Any:
    """Return `function(*args, **kwargs)` as another process computes it; blocks the calling thread meanwhile.

    Args:
        function: of a module's top level; with `on_progress` it gets a keyword `progress`, a function that
            takes the share that is done, 0..1.

    Raises:
        StudioError: what the function raised, or that the process broke off.
    """
    worker = _take()
    kind, value = "broken", None
    try:
        worker.connection.send((function, args, kwargs, on_progress is not None))
        while True:
            kind, value = worker.connection.recv()
            if kind != "progress":
                break
            if on_progress is not None:
                on_progress(value)
    except (EOFError, BrokenPipeError, ConnectionResetError):
        kind = "broken"
    finally:
        worker.connection.close()
        worker.process.join()
        _replace_spare()
    if kind == "done":
        return value
    if kind == "error":
        raise value
    if kind == "crash":
        _log.error("%s failed in its process:\n%s", function.__qualname__, value)
        raise StudioError(
            f"{function.__qualname__} failed: {value.strip().splitlines()[-1]}; see the server's log"
        )
    raise StudioError(f"{function.__qualname__} broke off (exit code {worker.process.exitcode}); try again")


def _work(connection: Connection, preloaded: tuple[str, ...]) -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for the server, which ends its workers
    if hasattr(os, "nice"):
        os.nice(_NICENESS)
    for name in preloaded:
        importlib.import_module(name)
    try:
        function, args, kwargs, progress = connection.recv()
    except (EOFError, ConnectionResetError):
        return  # the server has gone, or needs no spare any more
    if progress:
        kwargs = kwargs | {"progress": lambda share: connection.send(("progress", float(share)))}
    try:
        connection.send(("done", function(*args, **kwargs)))
    except StudioError as error:
        connection.send(("error", error))
    except BrokenPipeError:
        return  # the server has gone
    except Exception:  # the boundary of the process: the server logs it
        connection.send(("crash", traceback.format_exc()))
