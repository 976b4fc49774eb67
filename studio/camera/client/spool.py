"""The client's spool: frames of recordings on its own disk until the server has them on its disk.

A spool is a folder of segments, `<number>.spool`, each of one take and one start of the client. A segment begins
with `MAGIC` and a record whose data is JSON (take, hello); the other records are frames. A record is

    length of data  uint32    CRC-32 of number and data  uint32    number  uint64    data

little-endian. Every record is written by one call without a buffer, so that it outlives a killed program.
`sync` waits for the disk; the link calls it every second, so a power cut loses at most one second. A segment is
deleted once all of its frames are acknowledged. A record that a crash interrupted ends its segment.
"""

import logging
import os
import struct
import time
import zlib
from array import array
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import IO

import msgspec

from studio import wire
from studio.engine.base.errors import SettingsError
from studio.engine.base.sentences import say, system_says
from studio.take.folder.lock import hold, release
from studio.take.raw.ranges import Ranges

MAGIC = b"CSSPOOL1"
SEGMENT_BYTES = 4 * 1024 * 1024
MAX_BYTES = 2 * 1024 * 1024 * 1024
"""Largest size. A skeleton of 25 joints takes about 500 bytes: at 30 Hz this is a day and a half."""

_HEAD = struct.Struct("<IIQ")

log = logging.getLogger(__name__)


class Origin(msgspec.Struct, frozen=True):
    """Origin of a segment's frames: the take and its id, and the hello of the start that took them."""

    take: str
    take_id: str
    hello: wire.Hello

    @property
    def key(self) -> tuple[str, str]:
        """Take id and boot id."""
        return self.take_id, self.hello.boot_id


@dataclass
class Segment:
    """A file of the spool: the position of each frame, and which frames were acknowledged."""

    path: Path
    origin: Origin
    size: int
    sequences: "array[int]" = field(default_factory=lambda: array("Q"))
    offsets: "array[int]" = field(default_factory=lambda: array("Q"))
    acked: Ranges = field(default_factory=Ranges)


_origin_decoder = msgspec.json.Decoder(Origin)


class Spool:
    """Frames for the server, on disk.

    Attributes:
        size_bytes: size of all segments.
        refused: number of frames that were not kept, because the spool or the disk was full.
        problem: why the last frame was not kept; "" = no problem.
        unknown: takes (with the start that took the frames) that the server lacks; they are deleted first.
    """

    def __init__(self, folder: Path, *, max_bytes: int = MAX_BYTES) -> None:
        """Open the folder, made if missing, with the frames of earlier starts.

        Raises:
            SettingsError: the folder cannot be used, or another client uses it.
        """
        self.folder = folder
        self._max_bytes = max_bytes
        self.refused = 0
        self.problem = ""
        self.unknown: set[tuple[str, str]] = set()
        self._segments: list[Segment] = []
        self._writing: tuple[Segment, int] | None = None
        self._dirty = False
        try:
            folder.mkdir(parents=True, exist_ok=True)
            self._lock = hold(folder)
            files = sorted((f for f in folder.glob("*.spool") if f.stem.isdigit()), key=lambda f: int(f.stem))
        except OSError as error:
            raise SettingsError(
                "spool.unusable",
                "spool {folder} cannot be used: {error}; choose another --spool",
                folder=folder,
                error=system_says(error),
            ) from error
        if self._lock is None:
            raise SettingsError(
                "spool.in_use",
                "spool {folder} is used by another client; choose another --name or --spool",
                folder=folder,
            )
        self._number = int(files[-1].stem) if files else 0
        for file in files:
            self._load(file)

    @property
    def size_bytes(self) -> int:
        return sum(segment.size for segment in self._segments)

    @property
    def frames(self) -> int:
        """Number of frames not acknowledged yet."""
        return sum(len(segment.sequences) - segment.acked.count for segment in self._segments)

    def origins(self) -> list[Origin]:
        """Takes and starts with kept frames, the oldest first."""
        return list({segment.origin.key: segment.origin for segment in self._segments}.values())

    def sequences(self, key: tuple[str, str]) -> list[int]:
        """Sequences kept for a take and start and not acknowledged, in order."""
        found = {
            sequence
            for segment in self._of(key)
            for sequence in segment.sequences
            if sequence not in segment.acked
        }
        return sorted(found)

    def append(self, origin: Origin, sequence: int, data: bytes) -> bool:
        """Keep a frame; if it does not fit, count it and return False."""
        record = _record(sequence, data)
        while self.size_bytes + len(record) > self._max_bytes and self._drop_unknown():
            pass
        if self.size_bytes + len(record) > self._max_bytes:
            return self._refuse(
                say("camera.spool_full", "the spool is full ({mb} MB)", mb=self._max_bytes >> 20)
            )
        try:
            segment, handle = self._segment(origin)
            _write(handle, record)
        except OSError as error:
            if self._writing is not None:  # remove a record half written
                os.ftruncate(self._writing[1], self._writing[0].size)
            return self._refuse(
                say(
                    "camera.spool_unwritable",
                    "the spool cannot be written ({error})",
                    error=system_says(error),
                )
            )
        segment.sequences.append(sequence)
        segment.offsets.append(segment.size)
        segment.size += len(record)
        self.problem = ""
        self._dirty = True
        return True

    def read(self, key: tuple[str, str], sequence: int) -> bytes | None:
        """Return a kept frame, or None if it is missing or damaged."""
        for segment in self._of(key):
            try:
                offset = segment.offsets[segment.sequences.index(sequence)]
            except ValueError:
                continue
            with open(segment.path, "rb") as file:
                file.seek(offset)
                return next((data for number, data, _ in _records(file) if number == sequence), None)
        return None

    def acknowledge(self, key: tuple[str, str], up_to: int, missing: list[tuple[int, int]]) -> list[int]:
        """Drop frames up to `up_to` that are not in the ranges `missing`; return their sequences."""
        gone: list[int] = []
        for segment in self._of(key):
            if not segment.sequences or segment.sequences[0] > up_to or _inside(segment, missing):
                continue
            for sequence in segment.sequences:
                if sequence > up_to or any(begin <= sequence <= end for begin, end in missing):
                    continue
                if segment.acked.add(sequence):
                    gone.append(sequence)
            if segment.acked.count == len(segment.sequences):
                self._drop(segment)
        return gone

    @property
    def unknown_frames(self) -> int:
        """Number of frames of takes that the server lacks."""
        return sum(len(segment.sequences) for segment in self._segments if segment.origin.key in self.unknown)

    def age_s(self, key: tuple[str, str]) -> float:
        """Return the age of the last frame of a take and start [s]; 0 if there is none."""
        times = [segment.path.stat().st_mtime for segment in self._of(key)]
        return max(0.0, time.time() - max(times)) if times else 0.0

    def forget(self, key: tuple[str, str]) -> int:
        """Delete the frames of a take and start; return their number."""
        frames = 0
        for segment in self._of(key):
            if self._writing is not None and self._writing[0] is segment:
                self._end_segment()
            frames += len(segment.sequences) - segment.acked.count
            if segment in self._segments:
                self._segments.remove(segment)
                segment.path.unlink(missing_ok=True)
        self.unknown.discard(key)
        return frames

    def sync(self) -> None:
        """Wait until all frames so far are on the disk; may be called from another thread."""
        writing = self._writing
        if self._dirty and writing is not None:
            self._dirty = False
            try:
                os.fsync(writing[1])
            except OSError as error:  # closed meanwhile, which synced it; or a bad disk
                log.debug("spool: %s", error)

    def close(self) -> None:
        """Close the files; an empty spool is removed."""
        self._end_segment()
        release(self._lock)
        if not self._segments:
            try:
                self.folder.rmdir()
            except OSError:
                log.debug("spool folder %s stays", self.folder)

    # ---

    def _of(self, key: tuple[str, str]) -> list[Segment]:
        return [segment for segment in self._segments if segment.origin.key == key]

    def _drop_unknown(self) -> bool:
        """Delete the oldest take that the server lacks; return whether there was one."""
        key = next((origin.key for origin in self.origins() if origin.key in self.unknown), None)
        if key is None:
            return False
        log.warning(
            "the spool is full: %d frames of a take that the server does not have are deleted",
            self.forget(key),
        )
        return True

    def _refuse(self, problem: str) -> bool:
        if not self.problem:
            log.warning("%s: frames of the recording are not kept", problem)
        self.problem = problem
        self.refused += 1
        return False

    def _segment(self, origin: Origin) -> tuple[Segment, int]:
        """Return the segment to write to: the present one, or a new one."""
        if self._writing is not None:
            segment = self._writing[0]
            if segment.origin.key == origin.key and segment.size < SEGMENT_BYTES:
                return self._writing
            self._end_segment()
        path = self.folder / f"{self._number + 1}.spool"
        handle = os.open(path, os.O_RDWR | os.O_CREAT | os.O_EXCL | os.O_APPEND, 0o600)
        head = MAGIC + _record(0, msgspec.json.encode(_without_token(origin)))
        try:
            _write(handle, head)
        except OSError:
            os.close(handle)
            path.unlink(missing_ok=True)
            raise
        self._number += 1
        segment = Segment(path, origin, len(head))
        self._segments.append(segment)
        self._writing = (segment, handle)
        return self._writing

    def _end_segment(self) -> None:
        if self._writing is None:
            return
        segment, handle = self._writing
        self._writing = None
        try:
            os.fsync(handle)
        finally:
            os.close(handle)
        if segment.acked.count == len(segment.sequences):
            self._drop(segment)

    def _drop(self, segment: Segment) -> None:
        """Delete a segment with all frames acknowledged, unless it is being written."""
        if self._writing is not None and self._writing[0] is segment:
            if segment.size < SEGMENT_BYTES:
                return
            self._end_segment()
            return
        if segment in self._segments:
            self._segments.remove(segment)
            segment.path.unlink(missing_ok=True)

    def _load(self, path: Path) -> None:
        """Load a segment of an earlier start; one without a frame is deleted."""
        segment = None
        with open(path, "rb") as file:
            if file.read(len(MAGIC)) == MAGIC:
                for number, data, offset in _records(file):
                    if segment is None:
                        try:
                            segment = Segment(path, _origin_decoder.decode(data), 0)
                        except (msgspec.DecodeError, UnicodeDecodeError):
                            break
                    else:
                        segment.sequences.append(number)
                        segment.offsets.append(offset)
        if segment is None or not segment.sequences:
            path.unlink(missing_ok=True)
            return
        segment.size = path.stat().st_size
        self._segments.append(segment)


def _inside(segment: Segment, missing: list[tuple[int, int]]) -> bool:
    """Whether a whole segment lies in one of the ranges; sequences of a segment only grow."""
    return any(begin <= segment.sequences[0] and segment.sequences[-1] <= end for begin, end in missing)


def _without_token(origin: Origin) -> Origin:
    return Origin(origin.take, origin.take_id, msgspec.structs.replace(origin.hello, token=""))


def _record(sequence: int, data: bytes) -> bytes:
    body = struct.pack("<Q", sequence) + data
    return struct.pack("<II", len(data), zlib.crc32(body)) + body


def _write(handle: int, data: bytes) -> None:
    view = memoryview(data)
    while view:
        view = view[os.write(handle, view) :]


def _records(file: IO[bytes]) -> Iterator[tuple[int, bytes, int]]:
    """Yield number, data and offset of the whole records from the file's position."""
    while True:
        offset = file.tell()
        head = file.read(_HEAD.size)
        if len(head) < _HEAD.size:
            return
        length, crc, number = _HEAD.unpack(head)
        data = file.read(length) if length <= wire.MAX_MESSAGE_BYTES else b""
        if len(data) != length or zlib.crc32(head[8:] + data) != crc:
            return
        yield number, data, offset
