"""Writer of `raw.mcap`: a new file, or the continuation of one after a crash or for a late frame."""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO, Any, cast

import msgspec
from mcap.records import Channel
from mcap.writer import CompressionType, Writer

from studio import wire
from studio.engine.base.errors import TakeError
from studio.engine.base.file_sentences import unwritable
from studio.engine.base.sentences import system_says
from studio.engine.model.frames import CameraFrame
from studio.take.folder.lock import hold, release
from studio.take.raw.append import RawState, data_end, hello_of, index_bytes, save_torn_end
from studio.take.raw.live_log import LiveEvent
from studio.take.raw.records import LATE_KEY, LIVE_TOPIC, PROFILE, camera_topic, depth_topic

CHUNK_BYTES = 256 * 1024


class WholeFile:
    """A file without a buffer, so that nothing is left to write when the disk is full."""

    def __init__(self, path: Path, mode: str) -> None:
        self.raw = open(path, mode, buffering=0)

    def write(self, data: bytes) -> None:
        """Write all of it, or raise OSError."""
        view = memoryview(data)
        while view:
            view = view[self.raw.write(view) :]

    def tell(self) -> int:
        return self.raw.tell()

    def flush(self) -> None:
        """Does nothing, because there is no buffer."""


class RawWriter:
    """Writes a new `raw.mcap`, or continues one. Not thread-safe except for `sync`: one thread writes.

    Args:
        path: the file.
        state: continue the file in this state, from `append.scan_raw`; None: a new file.

    Raises:
        TakeError: the file exists already, or another program writes it; from any method: it cannot be written,
            or the disk is full.
    """

    def __init__(self, path: str | Path, *, state: RawState | None = None) -> None:
        self.path = Path(path)
        try:
            self._file = WholeFile(self.path, "xb" if state is None else "r+b")
        except FileExistsError as error:
            raise TakeError(
                "raw.exists", "{path} exists; raw recordings are never overwritten", path=self.path
            ) from error
        except OSError as error:
            raise TakeError(
                "raw.unwritable",
                "cannot write {path}: {error}; choose another folder",
                path=self.path,
                error=system_says(error),
            ) from error
        self._lock = hold(self.path)
        if state is not None and self._lock is None:
            self._file.raw.close()
            raise TakeError(
                "raw.in_use", "{path} is being written by another program; stop it first", path=self.path
            )
        self._writer = Writer(
            cast("IO[bytes]", self._file), chunk_size=CHUNK_BYTES, compression=CompressionType.ZSTD
        )
        self._channels: dict[str, int] = {}
        self._depth_channels: dict[str, int] = {}
        self._starts: dict[tuple[str, str], tuple[int, int | None]] = {}  # channels of skeletons and depth
        self._late_channels: dict[tuple[str, str], int] = {}
        self._all_channels: dict[int, Channel] = {}
        self._failed = False
        with self._disk_errors():
            if state is not None and state.end > 0:
                self._live = self._go_on(state)
            else:
                self._file.raw.truncate(0)
                self._writer.start(profile=PROFILE, library=PROFILE)
                self._live = self._register(LIVE_TOPIC, "json", {})
        self._dirty = True

    def _register(self, topic: str, encoding: str, metadata: dict[str, str]) -> int:
        number = self._writer.register_channel(topic, encoding, 0, metadata)
        self._all_channels[number] = Channel(number, topic, encoding, metadata, 0)
        return number

    def _go_on(self, state: RawState) -> int:
        """Write new data over the index or the incomplete end; return the channel of the live log."""
        save_torn_end(self.path, state)
        self._file.raw.truncate(state.end)
        self._file.raw.seek(state.end)
        live = None
        for number in range(1, max(state.channels, default=0) + 1):  # numbers do not change
            channel = state.channels.get(number, Channel(number, "lost", "", {}, 0))
            self._register(channel.topic, channel.message_encoding, channel.metadata)
            live = number if channel.topic == LIVE_TOPIC else live
            hello = hello_of(channel)
            if hello is None:
                continue
            if LATE_KEY in channel.metadata:
                self._late_channels[hello.name, hello.boot_id] = number
            elif channel.topic == depth_topic(hello.name):
                self._depth_channels[hello.name] = number
                skeletons, _ = self._starts.get((hello.name, hello.boot_id), (number, None))
                self._starts[hello.name, hello.boot_id] = (skeletons, number)
            else:
                self._channels[hello.name] = number
                self._depth_channels.pop(hello.name, None)
                self._starts[hello.name, hello.boot_id] = (number, None)
        return self._register(LIVE_TOPIC, "json", {}) if live is None else live

    def __enter__(self) -> "RawWriter":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def add_camera(self, hello: wire.Hello) -> None:
        """Write a camera's frames to the channel of this start of its client, which is made if needed.

        Call it again when the client starts again, or an earlier start returns. The token is not written.
        """
        key, metadata = (hello.name, hello.boot_id), {"hello": _json(hello)}
        if key not in self._starts:
            skeletons = self._register(camera_topic(hello.name), "msgpack", metadata)
            depth = None
            if hello.intrinsics is not None:
                depth = self._register(depth_topic(hello.name), "msgpack", metadata)
            self._starts[key] = (skeletons, depth)
        self._channels[hello.name], depth = self._starts[key]
        self._depth_channels.pop(hello.name, None)
        if depth is not None:
            self._depth_channels[hello.name] = depth

    def frame(self, camera: str, data: bytes, *, arrival_ns: int, device_time_ns: int, sequence: int) -> None:
        """Write the bytes of a camera's `SkeletonFrame`, which the caller has checked.

        Raises:
            KeyError: `add_camera` was not called for the camera.
        """
        self._message(self._channels[camera], data, arrival_ns, device_time_ns, sequence)

    def late_frame(self, hello: wire.Hello, data: bytes, *, arrival_ns: int, frame: CameraFrame) -> None:
        """Write the bytes of a `SkeletonFrame` that arrived after the live solve had passed it."""
        key = (hello.name, hello.boot_id)
        if key not in self._late_channels:
            metadata = {"hello": _json(hello), LATE_KEY: "yes"}
            self._late_channels[key] = self._register(camera_topic(hello.name), "msgpack", metadata)
        self._message(self._late_channels[key], data, arrival_ns, frame.device_time_ns, frame.sequence)

    def depth(self, camera: str, data: bytes, *, arrival_ns: int, device_time_ns: int, sequence: int) -> None:
        """Write the bytes of a camera's `DepthImage`, which the caller has checked.

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

    def event(self, time_ns: int, event: LiveEvent) -> None:
        """Write an event of the live log, in its place between the frames; numbers must be finite."""
        data = msgspec.json.encode(event, enc_hook=_plain)
        with self._disk_errors():
            self._writer.add_message(self._live, log_time=time_ns, data=data, publish_time=time_ns)
        self._dirty = True

    def write_out(self) -> None:
        """End the present chunk, so that all data outlives this program, but not the machine."""
        if self._dirty:
            with self._disk_errors():
                self._writer.flush()
            self._dirty = False

    def sync(self) -> None:
        """Wait until all data passed on is on the disk; a thread other than the writing one may wait."""
        with self._disk_errors():
            os.fsync(self._file.raw.fileno())

    def flush(self) -> None:
        """End the present chunk and wait until all is on the disk."""
        if self._dirty:
            self.write_out()
            self.sync()

    def close(self) -> None:
        """Finish the file (a second call does nothing); after an error, keep its whole records."""
        if self._file.raw.closed:
            return
        failed = self._failed
        try:
            if not failed:
                self.flush()
            with self._disk_errors():
                self._finish()
        finally:
            release(self._lock)
            self._file.raw.close()
        if failed:
            raise TakeError(
                "raw.not_all_written",
                "cannot write all of {path}; what was written before the disk failed is kept",
                path=self.path,
            )

    def _finish(self) -> None:
        with open(self.path, "rb") as readable:
            end = data_end(readable, self._file.raw.seek(0, os.SEEK_END))
            index = index_bytes(readable, end, self._all_channels)
        self._file.raw.truncate(end)  # a record half written at a disk error makes room for the index
        self._file.raw.seek(end)
        self._file.write(index)
        os.fsync(self._file.raw.fileno())

    @contextmanager
    def _disk_errors(self) -> Iterator[None]:
        try:
            yield
        except OSError as error:
            self._failed = True
            raise TakeError(unwritable(self.path, error)) from error


def _json(hello: wire.Hello) -> str:
    return msgspec.json.encode(msgspec.structs.replace(hello, token="")).decode()


def _plain(value: Any) -> Any:
    """Return a number of NumPy as Python's, a sentence as its text."""
    return str(value) if isinstance(value, str) else value.item()
