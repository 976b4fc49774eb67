"""`raw.mcap`: every frame of every camera as it came, and the live log. This is the writer and the records.

One channel per camera and start of its client, topic `camera/<name>/skeleton`: the message is the bytes of
the `SkeletonFrame`; a camera that has intrinsics has a second one, `camera/<name>/depth`, with the bytes of each
`DepthImage`. log_time = arrival [ns, server's clock], publish_time = device time [ns], sequence = the frame's
number modulo 2**32; the channels' metadata hold the `Hello`. The channel `live` holds events as JSON.
Chunks are compressed by zstd; `RawWriter.flush` ends the chunk in progress and waits for the disk, so that a
crash loses nothing that came before it. `raw_reader` reads what there is of a damaged file, `raw_depth` the depth.
"""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import msgspec
from mcap.writer import CompressionType, Writer

from studio import wire
from studio.engine.errors import TakeError
from studio.engine.frames import CameraFrame
from studio.take.lock import hold, release
from studio.take.raw_reader import RawReader, RawSummary, inspect_raw
from studio.take.raw_records import (
    LIVE_TOPIC,
    PROFILE,
    RawCamera,
    RawDepth,
    RawEvent,
    RawFrame,
    RawRecord,
    camera_frame,
    camera_topic,
    depth_topic,
)

__all__ = [
    "RawCamera",
    "RawDepth",
    "RawEvent",
    "RawFrame",
    "RawReader",
    "RawRecord",
    "RawSummary",
    "RawWriter",
    "camera_frame",
    "camera_frames",
    "inspect_raw",
    "read_raw",
]

CHUNK_BYTES = 256 * 1024


class RawWriter:
    """Writes a new `raw.mcap`. Not thread-safe: one thread writes.

    Raises:
        TakeError: the file exists already; from any method: it cannot be written, or the disk is full.
    """

    def __init__(self, path: str | Path) -> None:
        self.path = Path(path)
        try:
            self._file = open(self.path, "xb")
        except FileExistsError as error:
            raise TakeError(f"{self.path} exists; raw recordings are never overwritten") from error
        except OSError as error:
            raise TakeError(f"cannot write {self.path}: {error.strerror}; choose another folder") from error
        self._lock = hold(self.path)
        self._writer = Writer(self._file, chunk_size=CHUNK_BYTES, compression=CompressionType.ZSTD)
        self._writer.start(profile=PROFILE, library=PROFILE)
        self._channels: dict[str, int] = {}
        self._depth_channels: dict[str, int] = {}
        self._live = self._writer.register_channel(LIVE_TOPIC, "json", 0)
        self._dirty = True

    def __enter__(self) -> "RawWriter":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def add_camera(self, hello: wire.Hello) -> None:
        """Begin a camera's channel; called again when the client starts anew. The token is not written."""
        metadata = {"hello": msgspec.json.encode(msgspec.structs.replace(hello, token="")).decode()}
        self._channels[hello.name] = self._writer.register_channel(
            camera_topic(hello.name), "msgpack", 0, metadata
        )
        self._depth_channels.pop(hello.name, None)
        if hello.intrinsics is not None:
            self._depth_channels[hello.name] = self._writer.register_channel(
                depth_topic(hello.name), "msgpack", 0, metadata
            )

    def frame(self, camera: str, data: bytes, *, arrival_ns: int, device_time_ns: int, sequence: int) -> None:
        """Write the bytes of a camera's `SkeletonFrame`, which the caller has decoded and found right.

        Raises:
            KeyError: `add_camera` was not called for the camera.
        """
        self._message(self._channels[camera], data, arrival_ns, device_time_ns, sequence)

    def depth(self, camera: str, data: bytes, *, arrival_ns: int, device_time_ns: int, sequence: int) -> None:
        """Write the bytes of a camera's `DepthImage`, which the caller has decoded and found right.

        Raises:
            KeyError: `add_camera` was not called for the camera, or its hello has no intrinsics.
        """
        self._message(self._depth_channels[camera], data, arrival_ns, device_time_ns, sequence)

    def _message(
        self, channel: int, data: bytes, arrival_ns: int, device_time_ns: int, sequence: int
    ) -> None:
        with self._disk_errors():
            self._writer.add_message(
                channel,
                log_time=arrival_ns,
                data=data,
                publish_time=device_time_ns,
                sequence=sequence & 0xFFFFFFFF,
            )
        self._dirty = True

    def event(self, time_ns: int, event: dict[str, Any]) -> None:
        """Write an event of the live log, in its place between the frames; numbers must be finite."""
        data = msgspec.json.encode(event)
        with self._disk_errors():
            self._writer.add_message(self._live, log_time=time_ns, data=data, publish_time=time_ns)
        self._dirty = True

    def flush(self) -> None:
        """End the chunk in progress and wait until all is on the disk."""
        if self._dirty:
            with self._disk_errors():
                self._writer.flush()
                os.fsync(self._file.fileno())
            self._dirty = False

    def close(self) -> None:
        """Finish the file (a second call does nothing)."""
        if self._file.closed:
            return
        try:
            with self._disk_errors():
                self._writer.finish()
                self._file.flush()
                os.fsync(self._file.fileno())
        finally:
            release(self._lock)
            with self._disk_errors():
                self._file.close()

    @contextmanager
    def _disk_errors(self) -> Iterator[None]:
        try:
            yield
        except OSError as error:
            raise TakeError(f"cannot write {self.path}: {error.strerror}; free some space") from error


def read_raw(path: str | Path) -> Iterator[RawRecord]:
    """Return the records of a `raw.mcap` in file order; see `raw_reader.RawReader`.

    Raises:
        TakeError: no such file. A damaged file is no error: it yields what can be read.
    """
    return iter(RawReader(path))


def camera_frames(path: str | Path) -> dict[str, list[CameraFrame]]:
    """Return canonical frames by camera: cameras in order of their first hello, frames in device time order.

    A device time that came twice (a client sent a frame again) is kept once.

    Raises:
        TakeError: no such file.
    """
    frames: dict[str, dict[int, CameraFrame]] = {}
    for record in read_raw(path):
        if isinstance(record, RawCamera):
            frames.setdefault(record.hello.name, {})
        elif isinstance(record, RawFrame):
            frames[record.camera].setdefault(record.frame.device_time_ns, record.frame)
    return {name: [by_time[t] for t in sorted(by_time)] for name, by_time in frames.items()}
