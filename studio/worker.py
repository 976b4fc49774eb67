"""Work in a process of its own, so that neither the live stage nor the server waits for it."""

import logging
import multiprocessing
import os
import signal
import traceback
from collections.abc import Callable
from multiprocessing.connection import Connection
from typing import Any

from studio.engine.errors import StudioError

_log = logging.getLogger(__name__)

_NICENESS = 10
"""Recording and the live stage come first where cores are short."""


def run_in_process(
    function: Callable[..., Any],
    *args: Any,
    on_progress: Callable[[float], None] | None = None,
    **kwargs: Any,
) -> Any:
    """Return `function(*args, **kwargs)` as a new process computes it; blocks the calling thread meanwhile.

    Args:
        function: of a module's top level; with `on_progress` it gets a keyword `progress`, a function that
            takes the share that is done, 0..1.

    Raises:
        StudioError: what the function raised, or that the process broke off.
    """
    context = multiprocessing.get_context("spawn")
    here, there = context.Pipe(duplex=False)
    process = context.Process(
        target=_work, args=(there, function, args, kwargs, on_progress is not None), daemon=True
    )
    process.start()
    there.close()
    try:
        while True:
            kind, value = here.recv()
            if kind != "progress":
                break
            if on_progress is not None:
                on_progress(value)
    except EOFError:
        kind, value = "broken", None
    finally:
        here.close()
        process.join()
    if kind == "done":
        return value
    if kind == "error":
        raise value
    if kind == "crash":
        _log.error("%s failed in its process:\n%s", function.__qualname__, value)
        raise StudioError(
            f"{function.__qualname__} failed: {value.strip().splitlines()[-1]}; see the server's log"
        )
    raise StudioError(f"{function.__qualname__} broke off (exit code {process.exitcode}); try again")


def _work(
    connection: Connection, function: Callable[..., Any], args: Any, kwargs: dict[str, Any], progress: bool
) -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for the server, which ends its workers
    if hasattr(os, "nice"):
        os.nice(_NICENESS)
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
