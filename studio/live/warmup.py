"""Prepares this process for its first pipeline, on a separate thread.

The first pipeline of a process loads and compiles code for all later ones. This takes seconds, and many more on a
machine without compiled code. On the engine thread that time would keep frames from the disk.
"""

import logging
import threading
from collections.abc import Callable

from studio.engine.model.calibration import Calibration

_log = logging.getLogger(__name__)
_lock = threading.Lock()
_ready, _ready_for_pictures, _wanted = threading.Event(), threading.Event(), threading.Event()

PAUSE_S = 3.0
"""Pause between the first pose and the rest, unless the rest is needed [s]: the page makes its first figure
meanwhile."""


def is_ready(calibration: Calibration | None = None) -> bool:
    """Whether a pipeline of these cameras can be started within milliseconds; None = of cameras with depth.

    Asking about cameras without depth starts their preparation at once.
    """
    with_pictures = calibration is not None and any(
        camera.lens is not None for camera in calibration.cameras.values()
    )
    if with_pictures:
        _wanted.set()
    return (_ready_for_pictures if with_pictures else _ready).is_set()


def warm_up() -> None:
    """Prepare the process; waits. Later calls return at once."""
    _prepare_one()
    _prepare_pictures()


class Preparation:
    """Prepares this process once, when that is allowed and needed.

    Attributes:
        begun: it is being prepared, or ready.
    """

    def __init__(self, then: Callable[[], None]) -> None:
        """`then` is called as by `begin`."""
        self.begun = False
        self._then, self._allowed, self._needed = then, False, False

    def allow(self) -> None:
        """Begin now or as soon as it is needed."""
        self._allowed = True
        self._begin()

    def need(self) -> None:
        """Begin now or as soon as it is allowed."""
        self._needed = True
        self._begin()

    def _begin(self) -> None:
        if self._allowed and self._needed and not self.begun:
            self.begun = True
            begin(self._then)


def begin(then: Callable[[], None]) -> None:
    """Prepare the process on a thread, and call `then` on that thread as soon as one performer can be solved, and
    again once cameras without depth can be used. Do nothing if both are ready. Without cameras that need it
    (`is_ready`), the second part begins after a pause."""
    if _ready.is_set() and _ready_for_pictures.is_set():
        return

    def run() -> None:
        _prepare_one()
        then()
        _wanted.wait(PAUSE_S)
        _prepare_pictures()
        then()
        _prepare(threading.Event(), "prepare_several", "a second performer")

    threading.Thread(target=run, name="warm-up", daemon=True).start()


def _prepare_one() -> None:
    _prepare(_ready, "prepare_one", "the first pose")


def _prepare_pictures() -> None:
    _prepare(_ready_for_pictures, "prepare_pictures", "the first pose of cameras without depth")


def _prepare(done: threading.Event, function: str, late: str) -> None:
    """Call a function of `studio.offline.warming`, unless it was done before; if it fails, `late` comes late."""
    with _lock:
        if done.is_set():
            return
        from studio.offline import warming  # slow to load

        try:
            getattr(warming, function)()
        except Exception:  # boundary of the thread: the live pipeline reports the error
            _log.exception("the solver could not be made ready; %s will come late", late)
        done.set()
