"""Several pieces of one work at once, each in a process of its own."""

import threading
from collections.abc import Callable, Mapping
from concurrent.futures import FIRST_EXCEPTION, Future, ThreadPoolExecutor, wait
from functools import partial
from typing import Any

from studio.worker import Stopped, run_in_process

_TOLD_S = 0.2


def run_several(
    function: str,
    works: Mapping[str, tuple[Any, ...]],
    *,
    processes: int,
    progress: Callable[[float], None] | None = None,
) -> dict[str, Any]:
    """Return what a function returns for several arguments, by name, in the order of `works`.

    Args:
        function: as for `run_in_process`, with a keyword `progress`.
        works: its arguments by name.
        processes: maximum number at once.
        progress: receives the share done of all; what it raises ends all processes.

    Raises:
        StudioError: a process's error; the others are stopped.
    """
    stop = threading.Event()
    shares = dict.fromkeys(works, 0.0)
    with ThreadPoolExecutor(max(1, min(processes, len(works)))) as pool:
        running: dict[str, Future[Any]] = {
            name: pool.submit(
                run_in_process,
                function,
                *arguments,
                on_progress=partial(shares.__setitem__, name),
                should_stop=stop.is_set,
                spare=False,
                inherits=True,
            )
            for name, arguments in works.items()
        }
        try:
            while not _over(running):
                if progress is not None:
                    progress(sum(shares.values()) / len(shares))
        finally:
            stop.set()
            pool.shutdown(cancel_futures=True)
    broken = [
        error for work in running.values() if not work.cancelled() and (error := work.exception()) is not None
    ]
    for error in sorted(broken, key=lambda error: isinstance(error, Stopped)):
        raise error  # the first failure, not the works that were stopped for it
    return {name: work.result() for name, work in running.items()}


def _over(running: dict[str, Future[Any]]) -> bool:
    """Wait a little; return whether all is done, or something went wrong."""
    done, left = wait(running.values(), timeout=_TOLD_S, return_when=FIRST_EXCEPTION)
    return not left or any(work.exception() is not None for work in done)
