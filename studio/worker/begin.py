"""The beginning of processes for work: copies of one that has loaded the code of a solve, or new ones.

Linux copies a process with all its memory in milliseconds (Python's fork server). The libraries of macOS do not work
in copies, and Windows has none. There every process begins anew and loads the code itself, which takes 1.5 s of
computing, or 3 s with what is slow at its first call.
"""

import multiprocessing
import os
import sys
from dataclasses import dataclass
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess

from studio.worker.process import work

COPIES = sys.platform == "linux"
"""Whether this system copies processes."""

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
    copied = COPIES and (copied or loaded)
    context = multiprocessing.get_context("forkserver" if copied else "spawn")
    if copied:
        context.set_forkserver_preload(_LOADED)
    here, there = context.Pipe()
    arguments = (there, loaded and not copied, gives_way, dict(os.environ))
    process = context.Process(target=work, args=arguments, daemon=True)  # type: ignore[attr-defined]
    process.start()
    there.close()
    return Worker(process, here)
