"""Records of binary FBX 7400: nodes with typed properties, the file's header and footer.

A file is a header, a list of nodes, an empty node and a footer. A node holds the absolute position of its end,
its properties and its children, closed by an empty node. The footer is a function of the creation time and the
file's identity. All three are constants here, so a file depends on its contents alone.
"""

import struct
import zlib
from collections.abc import Iterable, Sequence
from typing import IO

import numpy as np
from numpy.typing import NDArray

VERSION = 7400
CREATION_TIME = "1970-01-01 10:00:00:000"
FILE_ID = bytes.fromhex("28b32aebb624ccc2bfc8b02aa92bfcf1")
_FOOT_ID = bytes.fromhex("fabcab09d0c8d466b176fb831cf7267e")
_FOOT_END = bytes.fromhex("f85a8c6adef5d97eece90ce3758f290b")
_HEAD = b"Kaydara FBX Binary  \x00\x1a\x00" + struct.pack("<I", VERSION)
_EMPTY_NODE = bytes(13)
_ARRAY_CODES = {"float32": b"f", "float64": b"d", "int32": b"i", "int64": b"l"}


class EncodedArray:
    """An array property, compressed once and shared by several nodes."""

    def __init__(self, array: NDArray) -> None:
        """Encode a one-dimensional array of float32, float64, int32 or int64."""
        packed = zlib.compress(np.ascontiguousarray(array).tobytes(), 1)
        head = struct.pack("<III", array.size, 1, len(packed))
        self.data = _ARRAY_CODES[array.dtype.name] + head + packed


Value = bool | int | float | str | bytes | np.int64 | NDArray | EncodedArray


class Node:
    """A record: a name, values and child records.

    Values are written by their type: bool as C, int as a 32-bit I, np.int64 as L (identities, times),
    float as D, str as S, bytes as R, arrays by their dtype.
    """

    def __init__(
        self, name: str, *values: Value, children: Iterable["Node"] = (), closed: bool = False
    ) -> None:
        """Make a node; `closed` ends it with an empty node even without children."""
        self.name = name.encode()
        self.properties = [_encode(value) for value in values]
        self.children: Sequence[Node] = tuple(children)
        self._closed = closed or bool(self.children)
        self._properties_size = sum(map(len, self.properties))
        self.size: int = (
            13 + len(self.name) + self._properties_size + sum(child.size for child in self.children)
        ) + (len(_EMPTY_NODE) if self._closed else 0)

    def write(self, file: IO[bytes], start: int) -> int:
        """Write the node at the place `start` of the file and return the place after it."""
        head = struct.pack(
            "<IIIB", start + self.size, len(self.properties), self._properties_size, len(self.name)
        )
        file.write(head + self.name)
        for data in self.properties:
            file.write(data)
        place = start + len(head) + len(self.name) + self._properties_size
        for child in self.children:
            place = child.write(file, place)
        if self._closed:
            file.write(_EMPTY_NODE)
        return start + self.size


def write_nodes(file: IO[bytes], nodes: Iterable[Node]) -> None:
    """Write a whole FBX file of these top-level nodes."""
    file.write(_HEAD)
    place = len(_HEAD)
    for node in nodes:
        place = node.write(file, place)
    file.write(_EMPTY_NODE + _FOOT_ID + bytes(4))
    place += len(_EMPTY_NODE) + len(_FOOT_ID) + 4
    file.write(bytes(16 - place % 16))  # 1 to 16 bytes: a full block where the position is aligned
    file.write(struct.pack("<I", VERSION) + bytes(120) + _FOOT_END)


def _encode(value: Value) -> bytes:
    match value:
        case EncodedArray():
            return value.data
        case np.ndarray():
            return EncodedArray(value).data
        case _ if type(value) is np.int64:
            return b"L" + struct.pack("<q", int(value))
        case bool():
            return b"C" + struct.pack("<?", value)
        case int():
            return b"I" + struct.pack("<i", value)
        case float():
            return b"D" + struct.pack("<d", value)
        case str():
            encoded = value.encode()
            return b"S" + struct.pack("<I", len(encoded)) + encoded
        case bytes():
            return b"R" + struct.pack("<I", len(value)) + value
    raise TypeError(f"FBX has no property of type {type(value).__name__}")
