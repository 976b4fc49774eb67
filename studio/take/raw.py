"""`raw.mcap`: every frame of every camera as it came, and the live log.

One channel per camera and start of its client, topic `camera/<name>/skeleton`: the message is the bytes of the
`SkeletonFrame`; a camera that gives depth has a second one, `camera/<name>/depth`, of `DepthImage`. log_time =
arrival [ns, server's clock], publish_time = device time [ns], sequence = the frame's number modulo 2**32; the
channel's metadata hold the `Hello`. The channel `live` holds events as JSON. Chunks are compressed by zstd;
`RawWriter.flush` ends the chunk in progress and waits for the disk, so that a crash loses nothing that came before
it. `raw_reader` reads what there is of a damaged file, `raw_append` goes on with it.
"""

from collections.abc import Iterator
from pathlib import Path

from studio.engine.frames import CameraFrame
from studio.take.raw_clocks import TakeClocks
from studio.take.raw_reader import RawReader, RawSummary, inspect_raw
from studio.take.raw_records import (
    RawCamera,
    RawDepth,
    RawEvent,
    RawFrame,
    RawRecord,
    camera_frame,
)
from studio.take.raw_writer import CHUNK_BYTES, RawWriter

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
    """Return the records of a `raw.mcap` in file order; see `raw_reader.RawReader`.

    Raises:
        TakeError: no such file. A damaged file is no error: it yields what can be read.
    """
    return iter(RawReader(path))


def camera_frames(path: str | Path) -> dict[str, list[CameraFrame]]:
    """Return canonical frames by camera: cameras in order of their first hello, frames in device time order.

    A frame that came twice is kept once. Where a camera's client was started again within the take, or its clock
    jumped, all its frames have times on its last clock; frames whose clock is not known are left out.

    Raises:
        TakeError: no such file.
    """
    names: list[str] = []
    found: dict[tuple[str, str, int, int], CameraFrame] = {}
    clocks = TakeClocks()
    for record in read_raw(path):
        if isinstance(record, RawCamera):
            names.append(record.hello.name)
        elif isinstance(record, RawFrame):
            frame = record.frame
            found.setdefault((frame.camera, record.boot_id, frame.sequence, frame.device_time_ns), frame)
        elif isinstance(record, RawEvent):
            clocks.event(record.event)
    frames: dict[str, dict[int, CameraFrame]] = {name: {} for name in names}
    for (camera, boot_id, _, _), frame in found.items():
        placed = clocks.placed(frame, boot_id)
        if placed is not None:
            frames[camera].setdefault(placed.device_time_ns, placed)
    return {name: [by_time[t] for t in sorted(by_time)] for name, by_time in frames.items()}
