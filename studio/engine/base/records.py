"""A list of records of one type, written once and read often. Beyond `IN_MEMORY_BYTES` it is a temporary file."""

import tempfile
import weakref

import numpy as np
from numpy.typing import NDArray

from studio.engine.base.errors import TakeError
from studio.engine.base.sentences import system_says

BLOCK = 256
"""Records written at a time."""

IN_MEMORY_BYTES = 16 << 20
"""Lists up to this size stay in memory."""


class Records:
    """A list of records of one numpy type: append by `add`, read any part by `read`."""

    def __init__(self, dtype: np.dtype) -> None:
        """Make an empty list."""
        self.dtype = dtype
        self._waiting = np.zeros(BLOCK, dtype)
        self._written = self._count = 0
        self._file = tempfile.SpooledTemporaryFile(IN_MEMORY_BYTES, prefix="studio-records-")
        self.close = weakref.finalize(self, self._file.close)
        """Delete the records; this also happens when the object is deleted."""

    def __len__(self) -> int:
        return self._count

    def add(self, record: tuple | np.void | NDArray) -> None:
        """Append a record.

        Raises:
            TakeError: the disk of the temporary folder is full.
        """
        if self._count - self._written == BLOCK:
            self._write()
        self._waiting[self._count - self._written] = record
        self._count += 1

    def read(self, begin: int, end: int) -> NDArray:
        """Return a copy of the records from `begin` up to, but not including, `end`.

        Raises:
            TakeError: see `add`.
        """
        if self._written < self._count:
            self._write()
        count = max(min(end, self._count) - begin, 0)
        self._file.seek(begin * self.dtype.itemsize)
        found = bytearray(self._file.read(count * self.dtype.itemsize))
        return np.ndarray(count, self.dtype, found)

    def all(self) -> NDArray:
        """Return all records. A large list is mapped from the file, and changes to it change the file.

        Raises:
            TakeError: see `add`.
        """
        if self._count * self.dtype.itemsize <= IN_MEMORY_BYTES:
            return self.read(0, self._count)
        if self._written < self._count:
            self._write()
        self._file.flush()
        return np.memmap(self._file, self.dtype, "r+", shape=self._count)  # the map keeps the file open

    def _write(self) -> None:
        try:
            self._file.seek(self._written * self.dtype.itemsize)
            self._file.write(self._waiting[: self._count - self._written].tobytes())
        except OSError as error:
            raise TakeError(
                "take.no_working_space",
                "a long take is kept in {folder} while it is worked on, which does not take it: "
                "{error}; free some space or set TMPDIR",
                folder=tempfile.gettempdir(),
                error=system_says(error),
            ) from error
        self._written = self._count
