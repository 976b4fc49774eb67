"""Marks that a file or folder is in use by a running program; a crash takes the mark away by itself.

The mark is an advisory lock of the system (`flock`); where the system has none, nothing is ever marked.
"""

import os
from pathlib import Path

from studio.engine.system import hold


def release(handle: int | None) -> None:
    """Take the mark away again."""
    if handle is not None:
        os.close(handle)


def is_held(path: Path) -> bool:
    """Whether a running program marked the file or folder as in use."""
    handle = hold(path)
    release(handle)
    return handle is None


__all__ = ["hold", "is_held", "release"]
