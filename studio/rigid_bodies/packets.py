"""Reads binary packets from the front; a truncated packet raises an error."""

import struct

_MOST = 10_000
_LONGEST_TEXT = 256


class CutError(Exception):
    """A packet that ends too early, or has an impossible number of parts."""


class Packet:
    """Reads a packet, little-endian, from the front."""

    def __init__(self, data: bytes) -> None:
        self._data = data
        self._at = 0

    def numbers(self, form: str) -> tuple[float, ...]:
        """Return numbers in a format of `struct`."""
        try:
            found = struct.unpack_from("<" + form, self._data, self._at)
        except struct.error as error:
            raise CutError from error
        self._at += struct.calcsize("<" + form)
        return found

    def whole(self) -> int:
        """Return a 32-bit integer."""
        return int(self.numbers("i")[0])

    def count(self) -> int:
        """Return a number of parts."""
        value = self.whole()
        if not 0 <= value <= _MOST:
            raise CutError
        return value

    def text(self) -> str:
        """Return a zero-terminated text."""
        end = self._data.find(b"\0", self._at, self._at + _LONGEST_TEXT)
        if end < 0:
            raise CutError
        found = self._data[self._at : end].decode("utf-8", "replace")
        self._at = end + 1
        return found

    def skip(self, size: int) -> None:
        """Skip bytes."""
        self.part(size)

    def part(self, size: int) -> "Packet":
        """Return the next bytes as a packet, and skip them."""
        if size < 0 or self._at + size > len(self._data):
            raise CutError
        self._at += size
        return Packet(self._data[self._at - size : self._at])
