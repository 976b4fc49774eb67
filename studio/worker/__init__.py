"""Work in separate processes, so that neither the live stage nor the server waits for it.

A process takes seconds to load the code of a solve (`begin` says how). `warm_up` keeps a process ready. The next work
runs in it, and afterwards it waits for more, unless it has grown large or failed; then another process replaces it.
While it is busy, new work runs in a copy. Where processes are not copied, new work waits for it while it runs short
work, because loading a second process costs more.

The server names the function as a text, `studio.package.module:function`; only the process imports the module.
"""

import logging
import re
import threading
import time
from collections.abc import Callable
from typing import Any

from studio.engine.base.errors import StudioError
from studio.worker import begin
from studio.worker.begin import Worker
from studio.worker.process import interrupt

_log = logging.getLogger(__name__)

_LOOK_S = 0.05
"""Interval of checks whether running work should stop."""

_PATIENCE_S = (1.0, 30.0)
"""Times after a request to stop at which the work is interrupted, and its process is killed."""

_TEXT = re.compile(r"studio(\.[a-z]\w*)+:[a-z]\w*")


class Stopped(StudioError):
    """The work was stopped before it was done."""


_changed = threading.Condition()
"""Guards the variables below, and signals their changes."""
_spare: Worker | None = None
_warm = False
_soon_back: set[Worker] = set()
"""Processes with work that has been short so far, which will soon be ready again."""


def warm_up(after_s: float | None = 0.0) -> None:
    """Keep a process ready; returns at once. It is begun after `after_s` [s], or with the first work, because loading
    keeps a core busy for seconds; None: only with the first work."""
    global _warm
    with _changed:
        _warm = True
    if after_s is not None:
        threading.Thread(target=_begin_spare, args=(after_s,), name="warm up", daemon=True).start()


def _begin_spare(after_s: float) -> None:
    with _changed:
        _changed.wait_for(lambda: not _warm, after_s)
    _replace_spare()


def cool_down() -> None:
    """Stop keeping a process ready."""
    global _warm, _spare
    with _changed:
        _warm, spare, _spare = False, _spare, None
        _changed.notify_all()
    if spare is not None:
        spare.process.terminate()
        spare.process.join()
        spare.connection.close()


def _replace_spare() -> None:
    with _changed:
        if not _warm or _spare is not None:
            return
    worker = begin.begin(loaded=True)
    if not _keep(worker):
        worker.end()


def _keep(worker: Worker) -> bool:
    """Keep a process for the next work; return False if there is one, or none is to be kept."""
    global _spare
    with _changed:
        if not _warm or _spare is not None:
            return False
        _spare = worker
        _soon_back.discard(worker)
        _changed.notify_all()
    return True


def _take(short: bool) -> Worker:
    """Return the ready process; without one a copy, where there are copies, or one that is soon ready, or a new one.

    Args:
        short: the work may be short.
    """
    global _spare
    with _changed:
        _changed.wait_for(lambda: _spare is not None or begin.COPIES or not (_warm and _soon_back))
        worker, _spare = _spare, None
        if worker is None or not worker.process.is_alive():
            worker = None
        elif short:
            _soon_back.add(worker)
    if worker is None:
        worker = begin.begin(copied=_warm)
        if short:
            with _changed:
                _soon_back.add(worker)
    return worker


def _stays_away(worker: Worker) -> None:
    """Mark a process as not soon ready."""
    with _changed:
        _soon_back.discard(worker)
        _changed.notify_all()


def _put_back(worker: Worker, stays: bool) -> None:
    """Keep a healthy process for the next work if there is none; end any other."""
    if stays and _keep(worker):
        return
    worker.end()
    _replace_spare()
    _stays_away(worker)


class _Stopping:
    """Stops work: first by a request, which it sees at its next progress, then by an interruption, at last by
    force."""

    def __init__(self, worker: Worker) -> None:
        self._worker = worker
        self.told_s = 0.0
        self.pressed = 0

    def tell(self) -> None:
        """Send the request."""
        self._worker.connection.send(None)
        self.told_s = time.monotonic()

    def press(self) -> None:
        """Go to the next step if the time of the last one is over."""
        if not self.told_s or self.pressed == len(_PATIENCE_S):
            return
        if time.monotonic() - self.told_s < _PATIENCE_S[self.pressed]:
            return
        self.pressed += 1
        if self.pressed == len(_PATIENCE_S) or not interrupt(self._worker.process):
            self._worker.process.kill()


def run_in_process(
    function: str,
    /,
    *args: Any,
    on_progress: Callable[[float], None] | None = None,
    on_part: Callable[[Any], None] | None = None,
    should_stop: Callable[[], bool] | None = None,
    spare: bool = True,
    inherits: bool = False,
    **kwargs: Any,
) -> Any:
    """Return the result of a function for `args` and `kwargs` in another process; blocks the calling thread
    meanwhile.

    Args:
        function: a public one of the studio, as `studio.package.module:function`; with `on_progress` it gets a
            keyword `progress`, a function that takes the share done, 0..1.
        on_part: with it the function gets a keyword `show`, which takes a part of the result that is ready.
        args, kwargs: anything that pickles; a `Take` is sent as its path and opened in the other process.
        should_stop: called from time to time; once it is true, the work ends at its next progress below 1, or is
            interrupted after a second, and deletes its incomplete files.
        spare: use the process that is kept ready. Background work should leave it to others, and has low
            priority from its start.
        inherits: without `spare`, the process keeps the priority of this one, whose work it is part of.

    Raises:
        Stopped: the work was stopped.
        StudioError: the function's error, or the process ended early.
        ValueError: `function` is no such text.
    """
    if _TEXT.fullmatch(function) is None:
        raise ValueError(f"{function!r} names no work; allowed: studio.package.module:function")
    name = function.rpartition(":")[2]
    worker = (
        _take(short=on_progress is None)
        if spare
        else begin.begin(copied=_warm, gives_way=None if inherits else True)
    )
    kind, value, stays = "broken", None, False
    stopping = _Stopping(worker)
    try:
        worker.connection.send((function, on_progress is not None, on_part is not None))
        worker.connection.send((args, kwargs))
        while True:
            if should_stop is not None and not stopping.told_s and should_stop():
                stopping.tell()
            if should_stop is not None and not worker.connection.poll(_LOOK_S):
                stopping.press()
                continue
            kind, value, stays = worker.connection.recv()
            if kind == "long":
                _stays_away(worker)
            elif kind == "part":
                if on_part is not None:
                    on_part(value)
            elif kind != "progress":
                break
            elif on_progress is not None:
                on_progress(value)
    except (EOFError, BrokenPipeError, ConnectionResetError):
        kind = "broken"
    finally:
        _put_back(worker, spare and stays and kind not in ("progress", "part", "long"))
    if kind == "done":
        return value
    if kind == "stopped" or (kind == "broken" and stopping.pressed):
        raise Stopped("work.stopped", "{work} was stopped before it was done", work=name)
    if kind == "error":
        assert isinstance(value, BaseException)
        raise value
    if kind == "crash":
        _log.error("%s failed in its process:\n%s", function, value)
        raise StudioError(
            "work.failed",
            "{work} failed: {error}; see the server's log",
            work=name,
            error=str(value).strip().splitlines()[-1],
        )
    raise StudioError(
        "work.broke_off",
        "{work} broke off (exit code {code}); try again",
        work=name,
        code=worker.process.exitcode,
    )
