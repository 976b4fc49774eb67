"""`raw.mcap`: every frame of every camera as received, and the live log.

One channel per camera and start of its client, topic `camera/<name>/skeleton`: the message is the bytes of the
`SkeletonFrame`. A camera with depth has a second one, `camera/<name>/depth`, of `DepthImage`. log_time =
arrival [ns, server's clock], publish_time = device time [ns], sequence = the frame's number modulo 2**32; the
channel's metadata hold the `Hello`. The channel `live` holds events as JSON. Chunks are compressed by zstd;
`RawWriter.flush` ends the present chunk and waits for the disk, so that a crash loses nothing from before
it. `reader` reads a damaged file as far as possible, `append` continues it.
"""

from array import array
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from studio.engine.model.frames import CameraFrame
from studio.take.raw.clocks import TakeClocks
from studio.take.raw.kept_frames import KeptFrames
from studio.take.raw.reader import RawReader, RawSummary, inspect_raw
from studio.take.raw.records import (
    RawCamera,
    RawDepth,
    RawEvent,
    RawFrame,
    RawRecord,
    camera_frame,
)
from studio.take.raw.writer import CHUNK_BYTES, RawWriter

__all__ = [
    "CHUNK_BYTES",
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


def read_raw(path: str | Path) -> Iterator[RawRecord]:
    """Return the records of a `raw.mcap` in file order; see `reader.RawReader`.

    Raises:
        TakeError: no such file. A damaged file is no error; its readable part is returned.
    """
    return iter(RawReader(path))


def camera_frames(path: str | Path) -> dict[str, Sequence[CameraFrame]]:
    """Return canonical frames by camera: cameras in order of their first hello, frames in device time order.

    A frame that occurs twice is kept once. If a camera's client was started again within the take, or its clock
    jumped, all its frames have times on its last clock; frames of an unknown clock are left out. Frames of a
    long take are read from a temporary file on demand.

    Raises:
        TakeError: no such file, or the disk of the temporary folder is full.
    """
    kept, clocks, arrivals = KeptFrames(), TakeClocks(), _Arrivals()
    names: list[str] = []
    for record in read_raw(path):
        if isinstance(record, RawCamera):
            names.append(record.hello.name)
        elif isinstance(record, RawFrame):
            arrivals.add(record, kept.add(record.frame))
        elif isinstance(record, RawEvent):
            clocks.event(record.event)
    return {name: kept.frames(*arrivals.in_order(name, clocks)) for name in dict.fromkeys(names)}


class _Arrivals:
    """Times of a recording's frames: camera and start of its client, number and device time."""

    def __init__(self) -> None:
        self._clients: dict[tuple[str, str], int] = {}
        self._client, self._place = array("l"), array("q")
        self._sequence, self._time_ns = array("q"), array("q")

    def add(self, record: RawFrame, place: int) -> None:
        """Register a frame that is kept at this index."""
        client = (record.camera, record.boot_id)
        self._client.append(self._clients.setdefault(client, len(self._clients)))
        self._place.append(place)
        self._sequence.append(record.frame.sequence)
        self._time_ns.append(record.frame.device_time_ns)

    def in_order(self, camera: str, clocks: TakeClocks) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Return the indices of a camera's frames, and their times on its last clock [ns].

        They are in order of time; of frames with one time, only the first to arrive is returned.
        """
        clients = list(self._clients)
        placed: dict[int, int] = {}
        for place, client, sequence, time_ns in zip(
            self._place, self._client, self._sequence, self._time_ns, strict=True
        ):
            if clients[client][0] == camera:
                at_ns = clocks.placed_ns(*clients[client], sequence, time_ns)
                if at_ns is not None:
                    placed.setdefault(at_ns, place)
        times = sorted(placed)
        return np.array([placed[at] for at in times], dtype=np.int64), np.array(times, dtype=np.int64)
