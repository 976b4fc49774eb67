"""Marks that a file or folder is in use by a running program; a crash takes the mark away by itself.

The mark is an advisory lock of the system (`flock`); where the system has none, nothing is ever marked.
"""

import os
import sys
from pathlib import Path

if sys.platform != "win32":
    import fcntl

    def hold(path: Path) -> int | None:
        """Mark a file or folder as in use; return a handle for `release`, None where it is marked already."""
        handle = os.open(path, os.O_RDONLY)
        try:
            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            os.close(handle)
            return None
        return handle

else:

    def hold(path: Path) -> int | None:
        """Return a handle for `release`; this system marks nothing."""
        return os.open(os.devnull, os.O_RDONLY)


def release(handle: int | None) -> None:
    """Take the mark away again."""
    if handle is not None:
        os.close(handle)


def is_held(path: Path) -> bool:
    """Whether a running program marked the file or folder as in use."""
    handle = hold(path)
    release(handle)
    return handle is None
