"""Records of one kind that are written once and read often: many of them go to a temporary file, not to memory."""

import tempfile
import weakref

import numpy as np
from numpy.typing import NDArray

from studio.engine.errors import TakeError

BLOCK = 256
"""Records that are written at once."""

IN_MEMORY_BYTES = 16 << 20
"""Fewer bytes than this need no file."""


class Records:
    """Records of a type, which may be structured or an array: `add` at the end, `read` anywhere."""

    def __init__(self, dtype: np.dtype) -> None:
        """Begin with none."""
        self.dtype = dtype
        self._waiting = np.zeros(BLOCK, dtype)
        self._written = self._count = 0
        self._file = tempfile.SpooledTemporaryFile(IN_MEMORY_BYTES, prefix="studio-records-")
        self.close = weakref.finalize(self, self._file.close)
        """Delete what was kept; it goes with the object otherwise."""

    def __len__(self) -> int:
        return self._count

    def add(self, record: tuple | np.void | NDArray) -> None:
        """Keep a record.

        Raises:
            TakeError: the disk of the temporary folder is full.
        """
        if self._count - self._written == BLOCK:
            self._write()
        self._waiting[self._count - self._written] = record
        self._count += 1

    def read(self, begin: int, end: int) -> NDArray:
        """Return a copy of the records `begin` up to `end`, without it.

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
        """Return all records; many are mapped from the file, not read, and are changed there where they are changed.

        Raises:
            TakeError: see `add`.
        """
        if self._count * self.dtype.itemsize <= IN_MEMORY_BYTES:
            return self.read(0, self._count)
        if self._written < self._count:
            self._write()
        self._file.flush()
        return np.memmap(self._file, self.dtype, "r+", shape=self._count)  # which keeps what the file holds

    def _write(self) -> None:
        try:
            self._file.seek(self._written * self.dtype.itemsize)
            self._file.write(self._waiting[: self._count - self._written].tobytes())
        except OSError as error:
            raise TakeError(
                f"a long take is kept in {tempfile.gettempdir()} while it is worked on, which does not take it: "
                f"{error.strerror}; free some space or set TMPDIR"
            ) from error
        self._written = self._count
