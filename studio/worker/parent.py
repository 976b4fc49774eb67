"""The end of a process together with the program that started it, also where that was killed."""

import os
import threading
import time
from collections.abc import Callable

CHECK_S = 0.5
GRACE_S = 5.0
"""Time for an orderly end; a device's library may hang, also while it opens the device."""


def end_with_parent(parent: int, end: Callable[[], None] | None = None) -> None:
    """Watch the parent on a thread, and end this process once it is gone.

    Args:
        parent: process number of the parent.
        end: begins an orderly end, on the thread; `GRACE_S` later the process ends in any case. None: at once.
    """

    def watch() -> None:
        while os.getppid() == parent:
            time.sleep(CHECK_S)
        if end is not None:
            end()
            time.sleep(GRACE_S)
        os._exit(1)

    threading.Thread(target=watch, name="parent", daemon=True).start()
