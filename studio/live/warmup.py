"""Makes this process ready for its first pipeline, on a thread of its own.

The first pipeline of a process loads and compiles what all later ones find ready: seconds, and many more on a machine
where nothing was compiled before. On the engine thread that time would keep frames from the disk.
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
    """Make the process ready; waits. Later calls return at once."""
    with _lock:
        if _ready.is_set():
            return
        from studio.warming import prepare  # takes long to load

        try:
            prepare()
        except Exception:  # the boundary of the thread: the live pipeline tells what is wrong
            _log.exception("the solver could not be made ready; the first pose will come late")
        _ready.set()


def begin(then: Callable[[], None]) -> None:
    """Make the process ready on a thread, and call `then` on that thread."""

    def run() -> None:
        warm_up()
        then()

    threading.Thread(target=run, name="warm-up", daemon=True).start()
