"""ROS bags, version 1 (`.bag`) and 2 (`.db3`, or the folder around one), message by message.

Both are read from the beginning, without an index, so a truncated bag gives its readable part. rosbags decodes
messages, with the definitions in a version 1 bag and with those of ROS 2 Humble in a version 2 bag.

Source of the format: ROS wiki, "Bags/Format/2.0".
"""

import bz2
import sqlite3
import struct
from collections.abc import Collection, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import IO, Any, Protocol

from studio.engine.base.errors import FormatError
from studio.engine.base.file_sentences import unreadable
from studio.engine.base.sentences import say

_MAGIC = b"#ROSBAG V2.0\n"
_CHUNK, _CONNECTION, _MESSAGE, _BAG = 5, 7, 2, 3
_RECORD_BYTES_LIMIT = 256 * 1024 * 1024


@dataclass
class Topic:
    """A topic of a bag: its message type and number of messages."""

    message_type: str
    count: int = 0


class Bag(Protocol):
    """A bag: its topics by name, and its damage ("" = none; complete once it has been read)."""

    topics: dict[str, Topic]
    problem: str

    def messages(self, topics: Collection[str]) -> Iterator[tuple[str, int, Any]]:
        """Yield topic, time of recording [ns] and decoded message, in the order of the file."""
        ...


def open_bag(path: Path) -> Bag:
    """Return the bag at a path.

    Raises:
        FormatError: not a bag, or nothing of it can be read.
    """
    if path.suffix.lower() == ".bag":
        return Ros1Bag(path)
    return Ros2Bag(path)


@dataclass
class _Connection:
    topic: str
    message_type: str
    definition: str


@dataclass
class Ros1Bag:
    """A version 1 bag."""

    path: Path
    topics: dict[str, Topic] = field(default_factory=dict)
    problem: str = ""

    def __post_init__(self) -> None:
        from rosbags.typesys import Stores, TypesysError, get_types_from_msg, get_typestore

        self._connections: dict[int, _Connection] = {}
        self._types = get_typestore(Stores.EMPTY)
        for kind, number, _, _ in self._records():
            if kind == _MESSAGE and number in self._connections:
                connection = self._connections[number]
                self.topics.setdefault(connection.topic, Topic(connection.message_type)).count += 1
        definitions = {}
        try:
            for connection in self._connections.values():
                definitions.update(get_types_from_msg(connection.definition, connection.message_type))
            self._types.register(definitions)
        except TypesysError as error:
            raise FormatError(
                "import.definitions",
                "{path}: message definitions cannot be read ({error})",
                path=self.path,
                error=error,
            ) from error
        if not self.topics:
            raise FormatError(
                "import.no_message",
                "{path} holds no message that can be read: {error}",
                path=self.path,
                error=self.problem or "it is empty",
            )

    def messages(self, topics: Collection[str]) -> Iterator[tuple[str, int, Any]]:
        from rosbags.serde import SerdeError

        for kind, number, time_ns, data in self._records():
            connection = self._connections.get(number)
            if kind != _MESSAGE or connection is None or connection.topic not in topics:
                continue
            try:
                message = self._types.deserialize_ros1(data, connection.message_type)
            except (SerdeError, ValueError, struct.error, IndexError) as error:
                self.problem = self.problem or f"a message of {connection.topic} cannot be read ({error})"
                continue
            yield connection.topic, time_ns, message

    def _records(self) -> Iterator[tuple[int, int, int, bytes]]:
        """Yield kind, connection, time [ns] and data of every message; register connections and damage."""
        try:
            with open(self.path, "rb") as file:
                if file.read(len(_MAGIC)) != _MAGIC:
                    raise FormatError(
                        "import.not_ros_bag", "{path} is no ROS bag of version 2.0", path=self.path
                    )
                yield from self._file_records(file)
        except OSError as error:
            raise FormatError(unreadable(self.path, error)) from error

    def _file_records(self, file: IO[bytes]) -> Iterator[tuple[int, int, int, bytes]]:
        try:
            while (record := _read_record(file)) is not None:
                header, data = record
                kind = header.get("op", b"\0")[0]
                if kind == _BAG and struct.unpack("<Q", header["index_pos"])[0] == 0:
                    self.problem = self.problem or "it was not finished"
                elif kind == _CHUNK:
                    for inner_header, inner in _split(_unpack(header["compression"], data)):
                        yield from self._message(inner_header, inner)
                else:
                    yield from self._message(header, data)
        except (EOFError, ValueError, KeyError, struct.error, OSError, RuntimeError, IndexError) as error:
            self.problem = self.problem or f"it is cut or damaged ({error})"

    def _message(self, header: dict[str, bytes], data: bytes) -> Iterator[tuple[int, int, int, bytes]]:
        kind = header.get("op", b"\0")[0]
        if kind == _CONNECTION:
            about = _fields(data)
            self._connections[struct.unpack("<I", header["conn"])[0]] = _Connection(
                header["topic"].decode(),
                about["type"].decode().replace("/", "/msg/"),
                about["message_definition"].decode(),
            )
        elif kind == _MESSAGE:
            seconds, nanoseconds = struct.unpack("<II", header["time"])
            yield kind, struct.unpack("<I", header["conn"])[0], seconds * 10**9 + nanoseconds, data


def _read_record(file: IO[bytes]) -> tuple[dict[str, bytes], bytes] | None:
    """Return the next record's header and data; None at the end of the file."""
    length = file.read(4)
    if not length:
        return None
    header = _fields(_exactly(file, length))
    return header, _exactly(file, _whole(file.read(4)))


def _whole(length: bytes) -> bytes:
    if len(length) != 4:
        raise EOFError(say("import.record_at_end", "the file ends in a record"))
    return length


def _exactly(file: IO[bytes], length: bytes) -> bytes:
    (size,) = struct.unpack("<I", _whole(length))
    if size > _RECORD_BYTES_LIMIT:
        raise ValueError(say("import.record_size", "a record of {n} bytes", n=size))
    data = file.read(size)
    if len(data) != size:
        raise EOFError(say("import.record_at_end", "the file ends in a record"))
    return data


def _fields(data: bytes) -> dict[str, bytes]:
    """Return the fields of a record header: length, then name=value."""
    fields, place = {}, 0
    while place < len(data):
        (size,) = struct.unpack_from("<I", data, place)
        name, _, value = data[place + 4 : place + 4 + size].partition(b"=")
        fields[name.decode()] = value
        place += 4 + size
    return fields


def _split(data: bytes) -> Iterator[tuple[dict[str, bytes], bytes]]:
    """Yield the records of a chunk."""
    place = 0
    while place < len(data):
        (size,) = struct.unpack_from("<I", data, place)
        header = _fields(data[place + 4 : place + 4 + size])
        place += 4 + size
        (size,) = struct.unpack_from("<I", data, place)
        yield header, data[place + 4 : place + 4 + size]
        place += 4 + size


def _unpack(compression: bytes, data: bytes) -> bytes:
    if compression == b"lz4":
        import lz4.frame

        return _bounded(lz4.frame.LZ4FrameDecompressor(), data)
    return _bounded(bz2.BZ2Decompressor(), data) if compression == b"bz2" else data


def _bounded(unpacker: Any, data: bytes) -> bytes:
    """Return the unpacked data, unless it exceeds the size limit of a record."""
    unpacked = unpacker.decompress(data, _RECORD_BYTES_LIMIT)
    if not unpacker.eof:
        raise ValueError(
            say(
                "import.chunk_ends",
                "a chunk that ends early, or has over {n} bytes once unpacked",
                n=_RECORD_BYTES_LIMIT,
            )
        )
    return unpacked


@dataclass
class Ros2Bag:
    """A version 2 bag in SQLite: a `.db3`, or a folder of them, read in the order of their names."""

    path: Path
    topics: dict[str, Topic] = field(default_factory=dict)
    problem: str = ""

    def __post_init__(self) -> None:
        from rosbags.typesys import Stores, get_typestore

        self._types = get_typestore(Stores.ROS2_HUMBLE)
        self._files = sorted(self.path.glob("*.db3")) if self.path.is_dir() else [self.path]
        for file in self._files:
            for name, kind, _, _ in self._rows(file, "0", ()):
                self.topics.setdefault(name, Topic(kind)).count += 1
        if not self.topics:
            raise FormatError(
                "import.no_message",
                "{path} holds no message that can be read: {error}",
                path=self.path,
                error=self.problem or "it is empty",
            )

    def messages(self, topics: Collection[str]) -> Iterator[tuple[str, int, Any]]:
        from rosbags.serde import SerdeError

        wanted = tuple(topics)
        for file in self._files:
            for name, kind, time_ns, data in self._rows(file, "m.data", wanted):
                try:
                    message = self._types.deserialize_cdr(data, kind)
                except (SerdeError, KeyError, ValueError, struct.error, IndexError) as error:
                    self.problem = self.problem or f"a message of {name} cannot be read ({error})"
                    continue
                yield name, time_ns, message

    def _rows(self, file: Path, data: str, topics: tuple[str, ...]) -> Iterator[tuple[str, str, int, bytes]]:
        """Yield topic, type, time [ns] and data of every message; register damage."""
        among = f" AND t.name IN ({','.join('?' * len(topics))})" if topics else ""
        query = (  # row by row, so that everything before a damaged page is read
            f"SELECT m.id, t.name, t.type, m.timestamp, {data} FROM messages m NOT INDEXED "
            f"CROSS JOIN topics t ON t.id = m.topic_id WHERE m.id > ?{among} ORDER BY m.id LIMIT 1"
        )
        if _is_cut(file):
            self.problem = self.problem or "it is cut"
        connection = sqlite3.connect(f"{file.resolve().as_uri()}?mode=ro&immutable=1", uri=True)
        try:
            connection.execute("PRAGMA writable_schema=ON")  # makes SQLite read a truncated file
            number = -1
            while (row := connection.execute(query, (number, *topics)).fetchone()) is not None:
                number = row[0]
                yield row[1:]
        except sqlite3.Error as error:
            self.problem = self.problem or f"it is damaged ({error})"
        finally:
            connection.close()


def _is_cut(file: Path) -> bool:
    """Whether a SQLite file is shorter than its header says (SQLite, "Database File Format", 1.3)."""
    with open(file, "rb") as stream:
        header = stream.read(100)
    if len(header) < 100:
        return True
    page, pages = int.from_bytes(header[16:18], "big"), int.from_bytes(header[28:32], "big")
    return file.stat().st_size < (65536 if page == 1 else page) * pages
