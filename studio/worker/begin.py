"""The beginning of processes for work: copies of one that has loaded the code of a solve, or new ones.

Linux copies a process with all its memory in milliseconds (Python's fork server). The libraries of macOS do not work
in copies, and Windows has none. There every process starts empty and loads the code itself, which takes 1.5 s of
computing, or 3 s with what is slow at its first call.
"""

import logging
import multiprocessing
import os
import shutil
import sys
from dataclasses import dataclass
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess
from multiprocessing.util import get_temp_dir

from studio.worker.process import work

_log = logging.getLogger(__name__)

COPIES = sys.platform == "linux"
"""Whether this system copies processes; False after a copy has failed."""

_has_copied = False

_LOADED = ["studio.worker.loaded"]


@dataclass(eq=False)
class Worker:
    """A process that waits for work, and the connection to it."""

    process: BaseProcess
    connection: Connection

    def end(self) -> None:
        """End the process, which must not be at work."""
        self.connection.close()
        self.process.join()


def begin(*, loaded: bool = False, copied: bool = False, gives_way: bool | None = False) -> Worker:
    """Return a new process.

    Args:
        loaded: with the code of a solve. The first copy waits until this is loaded.
        copied: a copy is taken if the system has any, because this program keeps the loaded process anyway.
        gives_way: as for `work`.
    """
    global COPIES, _has_copied
    copied = COPIES and (copied or loaded)
    context = multiprocessing.get_context("forkserver" if copied else "spawn")
    if copied:
        context.set_forkserver_preload(_LOADED)
        _has_copied = True
    here, there = context.Pipe()
    arguments = (there, loaded and not copied, gives_way, dict(os.environ))
    process = context.Process(target=work, args=arguments, daemon=True)  # type: ignore[attr-defined]
    try:
        process.start()
    except (OSError, EOFError) as error:  # no room for its socket, or the loaded process was killed
        if not copied:
            raise
        _log.warning("processes are not copied from here on, so that works begin later: %s", error)
        COPIES = False
        here.close()
        return begin(loaded=loaded, gives_way=gives_way)
    finally:
        there.close()
    return Worker(process, here)


def tidy() -> None:
    """Remove what copying leaves on the disk, for a program that ends without Python's own end."""
    if _has_copied:
        shutil.rmtree(get_temp_dir(), ignore_errors=True)
