"""Marks that a file or folder is in use by a running program; the mark ends with the process.

The mark is an advisory lock of the system (`flock`); on a system without one, nothing is ever marked.
"""

import os
from pathlib import Path

from studio.engine.base.system import hold


def release(handle: int | None) -> None:
    """Remove the mark."""
    if handle is not None:
        os.close(handle)


def is_held(path: Path) -> bool:
    """Whether a running program marked the file or folder as in use."""
    handle = hold(path)
    release(handle)
    return handle is None


__all__ = ["hold", "is_held", "release"]
