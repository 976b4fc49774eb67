"""Bytes of a named pipe or a device's file, read until somebody says stop."""

import os
import selectors
import threading

WAIT_S = 0.2


class Pipe:
    """A named pipe, or a device's file, as a file. A read ends when `stopping` is set: who does not listen takes
    nobody's data.

    Args:
        path: of the pipe; nobody needs to write to it yet.
        stopping: ends a read that waits.
        ends: it ends when who wrote to it has closed it; else it waits for the next one.

    Raises:
        OSError: it cannot be opened.
    """

    def __init__(self, path: str, stopping: threading.Event, *, ends: bool) -> None:
        self._file = os.open(path, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0))
        self._ready = selectors.DefaultSelector()
        self._ready.register(self._file, selectors.EVENT_READ)
        self._stopping, self._ends = stopping, ends
        self._begun = False

    def __enter__(self) -> "Pipe":
        return self

    def __exit__(self, *_: object) -> None:
        self._ready.close()
        os.close(self._file)

    def read(self, size: int) -> bytes:
        """Return the next bytes; none at the end, or when it is stopped.

        Raises:
            OSError: a device was unplugged.
        """
        while not self._stopping.is_set():
            if not self._ready.select(WAIT_S):
                continue
            data = os.read(self._file, size)
            if data or (self._begun and self._ends):
                self._begun = True
                return data
            self._stopping.wait(WAIT_S)  # nobody writes to it
        return b""
