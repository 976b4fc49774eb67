"""Work in a process of its own, so that neither the live stage nor the server waits for it.

A process takes seconds to load what a solve needs. `warm_up` has one load it before there is work; the next work goes
to it, and afterwards it waits for more, unless it has grown large or something went wrong: then another one takes its
place.
"""

import importlib
import logging
import multiprocessing
import signal
import threading
import time
import traceback
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess
from typing import Any

from studio.engine.errors import StudioError
from studio.engine.system import lower_priority, peak_memory_bytes

_log = logging.getLogger(__name__)

_NICENESS = 10
"""Recording and the live stage come first where cores are short."""

_SHORT_S = 4.0
"""Work of less computing time gives way to nothing: somebody looks at the screen and waits for it."""

_PRELOADED = ("studio.replay", "studio.engine.export", "studio.warming")
"""Modules that a process loads before there is work; it calls `prepare` of those that have one."""

_LARGEST_BYTES = 800 * 1024**2
"""A process that has taken more memory than this is not kept."""

_LOOK_S = 0.05
"""How often a running work is asked whether it should stop."""


class Stopped(StudioError):
    """The work was told to stop before it was done."""


class _Leave(BaseException):
    """Raised inside a work that is to stop, past whatever catches errors there."""


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


def _put_back(worker: _Worker, stays: bool) -> None:
    """Have a process that stays wait for the next work where none does; let any other go."""
    global _spare
    with _lock:
        kept = stays and _warm and _spare is None
        if kept:
            _spare = worker
    if not kept:
        worker.connection.close()  # which ends it
        worker.process.join()
        _replace_spare()


def run_in_process(
    function: Callable[..., Any],
    *args: Any,
    on_progress: Callable[[float], None] | None = None,
    should_stop: Callable[[], bool] | None = None,
    spare: bool = True,
    **kwargs: Any,
) -> Any:
    """Return `function(*args, **kwargs)` as another process computes it; blocks the calling thread meanwhile.

    Args:
        function: of a module's top level; with `on_progress` it gets a keyword `progress`, a function that
            takes the share that is done, 0..1.
        should_stop: asked from time to time; once it is true, the work ends when it next tells its progress.
        spare: use the process that is kept ready; work that nobody waits for leaves it to others.

    Raises:
        Stopped: it was told to stop.
        StudioError: what the function raised, or that the process broke off.
    """
    worker = _take() if spare else _start()
    kind, value, stays = "broken", None, False
    try:
        worker.connection.send((function, args, kwargs, on_progress is not None))
        told = False
        while True:
            if should_stop is not None and not told:
                if should_stop():
                    worker.connection.send(None)
                    told = True
                elif not worker.connection.poll(_LOOK_S):
                    continue
            kind, value, stays = worker.connection.recv()
            if kind != "progress":
                break
            if on_progress is not None:
                on_progress(value)
    except (EOFError, BrokenPipeError, ConnectionResetError):
        kind = "broken"
    finally:
        _put_back(worker, spare and stays and kind != "progress")
    if kind == "done":
        return value
    if kind == "stopped":
        raise Stopped(f"{function.__qualname__} was stopped: newer work takes its place")
    if kind == "error":
        raise value
    if kind == "crash":
        _log.error("%s failed in its process:\n%s", function.__qualname__, value)
        raise StudioError(
            f"{function.__qualname__} failed: {value.strip().splitlines()[-1]}; see the server's log"
        )
    raise StudioError(f"{function.__qualname__} broke off (exit code {worker.process.exitcode}); try again")


def _work(connection: Connection, preloaded: tuple[str, ...]) -> None:
    """Do one work after the other until the server closes the connection."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for the server, which ends its workers
    if not preloaded:
        lower_priority(_NICENESS)
    for name in preloaded:
        prepare = getattr(importlib.import_module(name), "prepare", None)
        if prepare is not None:
            prepare()
    while True:
        try:
            work = connection.recv()
        except (EOFError, ConnectionResetError):
            return  # the server has gone, or needs this process no more
        if work is None:
            continue  # a word to stop that came after the end
        try:
            with _giving_way() as gave_way:
                kind, value, stays = _answer(connection, *work)
            connection.send((kind, value, stays and not gave_way.is_set()))
        except BrokenPipeError:
            return  # the server has gone


@contextmanager
def _giving_way() -> Iterator[threading.Event]:
    """Lower this process's priority for good once the work in the block has computed for long; the event tells."""
    done, gave_way = threading.Event(), threading.Event()
    until_s = time.process_time() + _SHORT_S

    def watch() -> None:
        while not done.wait(0.5):
            if time.process_time() > until_s:
                lower_priority(_NICENESS)
                gave_way.set()
                return

    threading.Thread(target=watch, daemon=True).start()
    try:
        yield gave_way
    finally:
        done.set()


def _answer(
    connection: Connection, function: Callable[..., Any], args: Any, kwargs: dict[str, Any], tells: bool
) -> tuple[str, Any, bool]:
    """Do a work; return how it ended, what it gave, and whether this process is fit for more."""

    def progress(share: float) -> None:
        if connection.poll():
            connection.recv()
            raise _Leave
        connection.send(("progress", float(share), True))

    try:
        value = function(*args, **kwargs | ({"progress": progress} if tells else {}))
    except _Leave:
        return "stopped", None, True
    except StudioError as error:
        return "error", error, True
    except BrokenPipeError:
        raise  # the server has gone
    except Exception:  # the boundary of the process: the server logs it
        return "crash", traceback.format_exc(), False
    return "done", value, peak_memory_bytes() < _LARGEST_BYTES
