"""Reader of `raw.mcap`, finished or not: it reads as much as it can, and reports damage instead of raising it."""

import struct
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import IO

import msgspec
import zstandard
from mcap.exceptions import McapError
from mcap.records import Channel, Chunk, Footer, McapRecord, Message
from mcap.stream_reader import MAGIC_SIZE, StreamReader

from studio import wire
from studio.engine.base.errors import FormatError, TakeError
from studio.engine.base.file_sentences import unreadable
from studio.take.raw.chunks import open_chunk
from studio.take.raw.live_log import read_event
from studio.take.raw.records import (
    LATE_KEY,
    LIVE_TOPIC,
    RawCamera,
    RawDepth,
    RawEvent,
    RawFrame,
    RawRecord,
    camera_frame,
    depth_topic,
)
from studio.take.raw.span import RawSpan

_RECORD_BYTES_LIMIT = 256 * 1024 * 1024
# Errors of a bad disk and of bytes that are not MCAP; ValueError covers checksums and text.
DAMAGE = (
    OSError,
    McapError,
    struct.error,
    zstandard.ZstdError,
    ValueError,
    EOFError,
    MemoryError,
    OverflowError,
)
_hello_decoder = msgspec.json.Decoder(wire.Hello)


class RawReader:
    """Iterates over the records of a `raw.mcap` in file order, once.

    A damaged chunk is left out; where the file's structure ends early, reading ends. Afterwards:

    Attributes:
        complete: the file was finished properly and nothing was left out.
        problem: the damage, for a person; None if `complete`.
        channels: the MCAP channels met, by number.
        chunk_offset: during the iteration, the offset of the present record's chunk in the file [bytes].
    """

    def __init__(self, path: str | Path) -> None:
        """Prepare to read; the file is opened later.

        Raises:
            TakeError: no such file.
        """
        self.path = Path(path)
        self.problem: str | None = None
        self._finished = False
        self.channels: dict[int, Channel] = {}
        self.chunk_offset = 0
        self._cameras: dict[int, wire.Hello] = {}
        self._depth: dict[int, wire.Hello] = {}
        self._live: set[int] = set()
        self._late: set[int] = set()
        if not self.path.is_file():
            raise TakeError(
                "take.no_raw",
                "{path} has no raw recording ({file}); record or import a take",
                path=self.path.parent,
                file=self.path.name,
            )

    def __iter__(self) -> Iterator[RawRecord]:
        for _, record in self.pairs():
            yield record

    def pairs(self) -> Iterator[tuple[McapRecord, RawRecord]]:
        """Yield the records of `__iter__`, each with its MCAP channel or message."""
        try:
            file = open(self.path, "rb")
        except OSError as error:
            raise TakeError(unreadable(self.path, error)) from error
        with file:
            for record in self._mcap_records(file):
                read = self._read(record)
                if read is not None:
                    yield record, read

    @property
    def complete(self) -> bool:
        return self._finished and self.problem is None

    def _mcap_records(self, file: IO[bytes]) -> Iterator[McapRecord]:
        """Yield channels and messages; register damage instead of raising it."""
        reader = StreamReader(file, emit_chunks=True, record_size_limit=_RECORD_BYTES_LIMIT)
        records = iter(reader.records)
        finished = False
        while True:
            offset = file.tell()
            try:
                record = next(records)
            except StopIteration:
                break
            except DAMAGE as error:
                self._note("the file was not finished, or is cut or damaged", error)
                break
            if isinstance(record, Chunk):
                try:
                    inner = open_chunk(record)
                except DAMAGE as error:
                    self._note("a chunk is damaged and was left out", error)
                    continue
                self.chunk_offset = max(offset, MAGIC_SIZE)
                yield from inner
            else:
                finished = finished or isinstance(record, Footer)
                yield record
        self._finished = finished

    def _read(self, record: McapRecord) -> RawRecord | None:
        if isinstance(record, Channel):
            return self._channel(record)
        if not isinstance(record, Message):
            return None
        if record.channel_id in self._live:
            try:
                event = read_event(record.data)
            except FormatError as error:
                self._note("an event of the live log cannot be read", error)
                return None
            return RawEvent(record.log_time, event)
        hello = self._cameras.get(record.channel_id) or self._depth.get(record.channel_id)
        if hello is None:
            self._note("a message belongs to a camera whose beginning was lost")
            return None
        try:
            message = wire.decode(record.data)
            if record.channel_id in self._depth:
                return _depth(hello, record, message)
            if not isinstance(message, wire.SkeletonFrame):
                raise FormatError(
                    "raw.wrong_kind",
                    "a {kind} where a {wanted} belongs",
                    kind=type(message).__name__,
                    wanted="SkeletonFrame",
                )
            frame = camera_frame(hello.name, hello.joint_set, message)
        except FormatError as error:
            self._note(f"a frame of {hello.name} cannot be read", error)
            return None
        late = record.channel_id in self._late
        return RawFrame(hello.name, record.log_time, message, frame, hello.boot_id, late)

    def _channel(self, channel: Channel) -> RawCamera | None:
        if channel.id in self._cameras or channel.id in self._depth or channel.id in self._live:
            return None  # the summary at the end of the file repeats every channel
        self.channels[channel.id] = channel
        if channel.topic == LIVE_TOPIC:
            self._live.add(channel.id)
            return None
        try:
            hello = _hello_decoder.decode(channel.metadata.get("hello", ""))
            wire.check_hello(hello)
        except (msgspec.DecodeError, UnicodeDecodeError, FormatError) as error:
            self._note(f"channel {channel.topic!r} is not that of a camera", error)
            return None
        if channel.topic == depth_topic(hello.name):
            self._depth[channel.id] = hello
            return None  # the camera's skeleton channel came before it
        known = any((h.name, h.boot_id) == (hello.name, hello.boot_id) for h in self._cameras.values())
        self._cameras[channel.id] = hello
        if LATE_KEY in channel.metadata:
            self._late.add(channel.id)
            if known:
                return None
        return RawCamera(hello)

    def _note(self, problem: str, error: Exception | None = None) -> None:
        if self.problem is None:
            detail = "" if error is None else f" ({str(error) or type(error).__name__})"
            self.problem = f"{problem}{detail}"


def _depth(hello: wire.Hello, record: Message, message: wire.Message) -> RawDepth:
    if not isinstance(message, wire.DepthImage):
        raise FormatError(
            "raw.wrong_kind",
            "a {kind} where a {wanted} belongs",
            kind=type(message).__name__,
            wanted="DepthImage",
        )
    if hello.intrinsics is None:
        raise FormatError("raw.depth_no_intrinsics", "a depth image of a camera without intrinsics")
    return RawDepth(hello.name, record.log_time, message, hello.intrinsics, hello.boot_id)


@dataclass
class RawSummary:
    """Summary of a `raw.mcap`.

    Attributes:
        hellos: every start of every camera, in file order.
        frames: number of skeletons by camera.
        depth_frames: number of depth images by camera, of those that have any.
        events: number of events of the live log.
        duration_s: from the first to the last frame [s] (`RawSpan`); 0 without frames.
        complete, problem: as `RawReader`.
    """

    hellos: list[wire.Hello] = field(default_factory=list)
    frames: dict[str, int] = field(default_factory=dict)
    depth_frames: dict[str, int] = field(default_factory=dict)
    events: int = 0
    duration_s: float = 0.0
    complete: bool = False
    problem: str | None = None


def inspect_raw(path: str | Path) -> RawSummary:
    """Return the summary of a `raw.mcap`, damaged or not.

    Raises:
        TakeError: no such file.
    """
    reader, summary = RawReader(path), RawSummary()
    span = RawSpan()
    for record in reader:
        if isinstance(record, RawCamera):
            summary.hellos.append(record.hello)
            summary.frames.setdefault(record.hello.name, 0)
        elif isinstance(record, RawFrame):
            summary.frames[record.camera] += 1
            key, taken_ns = (record.camera, record.boot_id), record.message.device_time_ns
            span.frame(key, record.arrival_ns, taken_ns, late=record.late)
        elif isinstance(record, RawDepth):
            summary.depth_frames[record.camera] = summary.depth_frames.get(record.camera, 0) + 1
            key, taken_ns = (record.camera, record.boot_id), record.message.device_time_ns
            span.frame(key, record.arrival_ns, taken_ns, late=False)
        else:
            summary.events += 1
            span.event(record.time_ns)
    if (ends := span.ends()) is not None:
        summary.duration_s = (ends[1] - ends[0]) * 1e-9
    summary.complete, summary.problem = reader.complete, reader.problem
    return summary
