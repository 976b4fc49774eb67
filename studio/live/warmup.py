"""Prepares this process for its first pipeline, on a separate thread.

The first pipeline of a process loads and compiles code for all later ones. This takes seconds, and many more on a
machine without compiled code. On the engine thread that time would keep frames from the disk.
"""

import logging
import threading
from collections.abc import Callable

_log = logging.getLogger(__name__)
_lock = threading.Lock()
_ready = threading.Event()


def is_ready() -> bool:
    """Whether a pipeline can be started within milliseconds."""
    return _ready.is_set()


def warm_up() -> None:
    """Prepare the process; waits. Later calls return at once."""
    with _lock:
        if _ready.is_set():
            return
        from studio.offline.warming import prepare_one  # slow to load

        try:
            prepare_one()
        except Exception:  # boundary of the thread: the live pipeline reports the error
            _log.exception("the solver could not be made ready; the first pose will come late")
        _ready.set()


def _warm_up_for_several() -> None:
    """Prepare for several performers, for whom nobody waits yet."""
    from studio.offline.warming import prepare_several  # slow to load

    try:
        prepare_several()
    except Exception:  # boundary of the thread: so do they
        _log.exception("a second performer will come late")


def begin(then: Callable[[], None]) -> None:
    """Prepare the process on a thread, and call `then` on that thread as soon as one performer can be solved."""

    def run() -> None:
        warm_up()
        then()
        _warm_up_for_several()

    threading.Thread(target=run, name="warm-up", daemon=True).start()
