"""Loading of much code at the start of a process."""

import gc
from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def loading() -> Iterator[None]:
    """Collect no garbage while code is loaded, and leave what is loaded out of later collections.

    A collection looks at everything that was loaded so far. Without them the server's code is loaded in a sixth less
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
