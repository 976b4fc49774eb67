"""Bytes of a named pipe or a device's file, read until stopped."""

import os
import selectors
import threading

WAIT_S = 0.2


class Pipe:
    """A named pipe, or a device's file, as a file. A read ends when `stopping` is set, so that a stopped reader takes
    no data from others.

    Args:
        path: path of the pipe, which may still be without a writer.
        stopping: ends a read that waits.
        ends: True = it ends when its writer closes it, False = it waits for the next writer.

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
            self._stopping.wait(WAIT_S)  # it has no writer
        return b""
