"""Continuation of a `raw.mcap`: its content, the position to continue at, and its index at the end.

The file is read record by record. Bytes after its last whole data record are the index of a finished
file, or a record that a crash interrupted; new chunks overwrite them. (MCAP format: mcap.dev/spec.)
"""

import struct
import zlib
from collections.abc import Iterator
from dataclasses import dataclass, field
from io import BytesIO
from pathlib import Path
from typing import IO, TypeVar

import msgspec
from mcap.data_stream import ReadDataStream, RecordBuilder
from mcap.opcode import Opcode
from mcap.records import Channel, Chunk, ChunkIndex, DataEnd, Footer, McapRecord, Message, Statistics
from mcap.stream_reader import MAGIC_SIZE
from mcap.writer import MCAP0_MAGIC

from studio import wire
from studio.engine.base.errors import FormatError, TakeError
from studio.engine.base.file_sentences import unreadable
from studio.engine.model.settings.settings import SettingsJson
from studio.take.raw.chunks import open_chunk
from studio.take.raw.live_log import LiveEvent, SettingsEvent, StartEvent, read_event
from studio.take.raw.ranges import Ranges
from studio.take.raw.reader import DAMAGE
from studio.take.raw.records import LATE_KEY, LIVE_TOPIC, camera_topic

MAX_TORN_BYTES = 1 << 30
"""Largest part of an incomplete end that is kept."""

_hello_decoder = msgspec.json.Decoder(wire.Hello)
_HEAD = struct.Struct("<BQ")
_Kind = TypeVar("_Kind", bound=LiveEvent)
_TICK = b'{"type":"tick"'
_SKIPPED = b'{"type":"skipped"'


@dataclass
class RawState:
    """Content of a `raw.mcap` that is needed to continue it.

    Attributes:
        end: end of the whole data records [bytes]; 0 without a valid beginning.
        torn: bytes after `end` that are no index of a finished file.
        channels: by number.
        hellos: starts of cameras, by (camera, boot id).
        frames: sequences of skeletons by (camera, boot id).
        arrived: those that arrived in time, of every start that joined the recording.
        newest_ns: the latest arrival or event [ns, server's clock], without late frames.
        ticks: number of output frames of the live solve.
        events: every event of the live log except ticks and skipped frames, in order, each with its time.
    """

    end: int = 0
    torn: int = 0
    channels: dict[int, Channel] = field(default_factory=dict)
    hellos: dict[tuple[str, str], wire.Hello] = field(default_factory=dict)
    frames: dict[tuple[str, str], Ranges] = field(default_factory=dict)
    arrived: dict[tuple[str, str], Ranges] = field(default_factory=dict)
    newest_ns: int = 0
    ticks: int = 0
    events: list[tuple[int, LiveEvent]] = field(default_factory=list)

    def last_event(self, kind: type[_Kind]) -> _Kind | None:
        """Return the last event of a kind."""
        return next((event for _, event in reversed(self.events) if isinstance(event, kind)), None)

    @property
    def settings(self) -> SettingsJson | None:
        """The last settings of the live solve."""
        events = (event for _, event in reversed(self.events))
        return next((one.settings for one in events if isinstance(one, (StartEvent, SettingsEvent))), None)


def walk(file: IO[bytes], size: int) -> Iterator[tuple[int, int, int]]:
    """Yield opcode, offset and content length of every whole record [bytes]."""
    offset = MAGIC_SIZE
    while offset + _HEAD.size <= size:
        file.seek(offset)
        opcode, length = _HEAD.unpack(file.read(_HEAD.size))
        if not 1 <= opcode <= max(Opcode) or offset + _HEAD.size + length > size:
            return
        yield opcode, offset, length
        offset += _HEAD.size + length


def data_end(file: IO[bytes], size: int) -> int:
    """Return the end of the whole records of a file of this size [bytes]."""
    return max((offset + _HEAD.size + length for _, offset, length in walk(file, size)), default=MAGIC_SIZE)


def scan_raw(path: Path) -> RawState:
    """Return the state of a `raw.mcap`, complete or not.

    Raises:
        TakeError: the file cannot be read.
    """
    state = RawState()
    try:
        size = path.stat().st_size
        with open(path, "rb") as file:
            if file.read(MAGIC_SIZE) == MCAP0_MAGIC:
                _scan(file, size, state)
    except OSError as error:
        raise TakeError(unreadable(path, error)) from error
    return state


def _scan(file: IO[bytes], size: int, state: RawState) -> None:
    finished, end, begun = False, MAGIC_SIZE, False
    cameras: dict[int, tuple[str, str]] = {}
    for opcode, offset, length in walk(file, size):
        if opcode == Opcode.DATA_END:
            finished = True
            break
        begun = begun or opcode == Opcode.HEADER
        end = offset + _HEAD.size + length
        if opcode != Opcode.CHUNK:
            continue
        file.seek(offset + _HEAD.size)
        try:
            chunk = Chunk.read(ReadDataStream(BytesIO(file.read(length))))
            records = open_chunk(chunk)
        except DAMAGE:
            continue  # the reader also leaves it out
        for record in records:
            _take_in(record, state, cameras)
    state.end = end if begun else 0
    state.torn = 0 if finished else size - state.end


def _take_in(record: McapRecord, state: RawState, cameras: dict[int, tuple[str, str]]) -> None:
    if isinstance(record, Channel):
        state.channels.setdefault(record.id, record)
        hello = hello_of(record)
        if hello is not None:
            state.hellos.setdefault((hello.name, hello.boot_id), hello)
            if record.topic == camera_topic(hello.name):
                cameras[record.id] = (hello.name, hello.boot_id)
                if LATE_KEY not in record.metadata:
                    state.arrived.setdefault((hello.name, hello.boot_id), Ranges())
    elif isinstance(record, Message):
        channel = state.channels.get(record.channel_id)
        late = channel is not None and LATE_KEY in channel.metadata
        state.newest_ns = state.newest_ns if late else max(state.newest_ns, record.log_time)
        if record.channel_id in cameras:
            key = cameras[record.channel_id]
            state.frames.setdefault(key, Ranges()).add(record.sequence)
            if not late:
                state.arrived[key].add(record.sequence)
        elif channel is not None and channel.topic == LIVE_TOPIC:
            if record.data.startswith(_TICK):
                state.ticks += 1
            elif not record.data.startswith(_SKIPPED):
                _event(record, state)


def _event(record: Message, state: RawState) -> None:
    try:
        state.events.append((record.log_time, read_event(record.data)))
    except FormatError:
        return  # the reader reports it


def hello_of(channel: Channel) -> wire.Hello | None:
    """Return the hello in a channel's metadata; None where it is not a camera's."""
    try:
        hello = _hello_decoder.decode(channel.metadata.get("hello", ""))
        wire.check_hello(hello)
    except (msgspec.DecodeError, UnicodeDecodeError, FormatError):
        return None
    return hello


def save_torn_end(path: Path, state: RawState) -> Path | None:
    """Copy the incomplete end of a file to a file next to it; return that file.

    Raises:
        OSError: it cannot be written.
    """
    if state.torn == 0:
        return None
    number = 1
    while (kept := path.with_name(f"raw.torn.{number}.bin")).exists():
        number += 1
    with open(path, "rb") as file:
        file.seek(state.end)
        kept.write_bytes(file.read(MAX_TORN_BYTES))
    return kept


def index_bytes(file: IO[bytes], size: int, channels: dict[int, Channel]) -> bytes:
    """Return the end of a file whose data ends at `size`: index, footer, magic."""
    statistics, chunks = _index(file, size)
    statistics.channel_count = len(channels)
    builder = RecordBuilder()
    DataEnd(0).write(builder)
    start = size + builder.count
    for record in (*channels.values(), statistics, *chunks):
        record.write(builder)
    data = builder.end()
    summary = data[start - size :]
    crc = zlib.crc32(struct.pack("<BQQQ", Opcode.FOOTER, 20, start, 0), zlib.crc32(summary))
    Footer(start, 0, crc).write(builder)
    return data + builder.end() + MCAP0_MAGIC


def _index(file: IO[bytes], size: int) -> tuple[Statistics, list[ChunkIndex]]:
    statistics = Statistics(0, 0, {}, 0, 0, 0, 0, 0, 0)
    chunks: list[ChunkIndex] = []
    for opcode, offset, length in walk(file, size):
        file.seek(offset + _HEAD.size)
        if opcode == Opcode.CHUNK:
            chunks.append(_chunk_index(file.read(min(length, 256)), offset, length))
        elif opcode == Opcode.MESSAGE_INDEX and chunks:
            channel, entries = struct.unpack("<HI", file.read(6))
            chunks[-1].message_index_offsets[channel] = offset
            chunks[-1].message_index_length += _HEAD.size + length
            counts = statistics.channel_message_counts
            counts[channel] = counts.get(channel, 0) + entries // 16
    statistics.chunk_count = len(chunks)
    statistics.message_count = sum(statistics.channel_message_counts.values())
    statistics.message_start_time = min((chunk.message_start_time for chunk in chunks), default=0)
    statistics.message_end_time = max((chunk.message_end_time for chunk in chunks), default=0)
    return statistics, chunks


def _chunk_index(head: bytes, offset: int, length: int) -> ChunkIndex:
    start, end, uncompressed, _crc, name = struct.unpack_from("<QQQII", head)
    compression = head[32 : 32 + name].decode()
    (compressed,) = struct.unpack_from("<Q", head, 32 + name)
    return ChunkIndex(
        chunk_length=_HEAD.size + length,
        chunk_start_offset=offset,
        compression=compression,
        compressed_size=compressed,
        message_end_time=end,
        message_index_length=0,
        message_index_offsets={},
        message_start_time=start,
        uncompressed_size=uncompressed,
    )
