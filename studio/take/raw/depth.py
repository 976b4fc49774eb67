"""The depth images of a `raw.mcap`, read from the disk on demand (a take may be larger than memory).

The file is read once to find the position of every image; an image is read, checked and unpacked when it is
needed. The last chunks are cached, so that a file in order of time is read once.
"""

from collections import OrderedDict
from collections.abc import Collection, Iterator, Mapping, Sequence
from pathlib import Path
from typing import IO, NamedTuple

import numpy as np
from mcap.records import Chunk, Message
from mcap.stream_reader import StreamReader
from numpy.typing import NDArray

from studio import wire
from studio.engine.base.errors import CalibrationError, FormatError, TakeError
from studio.engine.base.file_sentences import unreadable
from studio.engine.base.sentences import say
from studio.engine.model.calibration import Calibration
from studio.engine.model.cameras.depth import DepthCamera, DepthFrame
from studio.engine.model.frames import ClockModel
from studio.take.raw.chunks import open_chunk
from studio.take.raw.clocks import TakeClocks
from studio.take.raw.reader import DAMAGE, RawReader
from studio.take.raw.records import RawDepth, RawEvent, depth_camera

_CHUNKS_KEPT = 8


class _Place(NamedTuple):
    """Position of an image: its chunk's offset in the file, its channel, its times and number."""

    device_time_ns: int
    chunk_offset: int
    channel: int
    publish_time: int
    log_time: int
    sequence: int


class DepthRecording:
    """The depth images of a `raw.mcap`; opening it reads the file once.

    An image whose device time occurs twice is kept once. If a camera's client was started again within the take, all
    its images have times on its last clock. A camera that changed its intrinsics in the take keeps the first; images
    with others, or of an unknown clock, are left out.

    Attributes:
        cameras: intrinsics by camera, of the cameras with depth, in order of their first image.
        intrinsics: the same as they were sent.
        complete, problem: as `RawReader`; `problem` also reports images that were left out.

    Raises:
        TakeError: no such file. A damaged file is no error; its readable part is used.
    """

    def __init__(self, path: str | Path) -> None:
        self.path = Path(path)
        self.cameras: dict[str, DepthCamera] = {}
        self.intrinsics: dict[str, wire.Intrinsics] = {}
        found: list[tuple[str, str, _Place]] = []
        clocks = TakeClocks()
        reader, other = RawReader(path), 0
        for record, raw in reader.pairs():
            if isinstance(raw, RawEvent):
                clocks.event(raw.event)
            if not (isinstance(raw, RawDepth) and isinstance(record, Message)):
                continue
            if self.intrinsics.setdefault(raw.camera, raw.intrinsics) != raw.intrinsics:
                other += 1
                continue
            place = _Place(
                raw.message.device_time_ns,
                reader.chunk_offset,
                record.channel_id,
                record.publish_time,
                record.log_time,
                raw.message.sequence,
            )
            found.append((raw.camera, raw.boot_id, place))
        places: dict[str, dict[int, _Place]] = {}
        for camera, boot_id, place in found:
            time_ns = clocks.placed_ns(camera, boot_id, place.sequence, place.device_time_ns)
            if time_ns is not None:
                placed = place._replace(device_time_ns=time_ns)
                places.setdefault(camera, {}).setdefault(time_ns, placed)
        self.complete, self.problem = reader.complete, reader.problem
        if other and self.problem is None:
            self.problem = f"{other} depth images have other intrinsics than the camera's first; left out"
        self.cameras = {name: depth_camera(self.intrinsics[name]) for name in places}
        self._places = {name: [of[time] for time in sorted(of)] for name, of in places.items()}

    def times_ns(self, camera: str) -> NDArray[np.int64]:
        """Return the device times of a camera's images [ns], increasing."""
        return np.array([place.device_time_ns for place in self._places[camera]], dtype=np.int64)

    def frames(
        self,
        cameras: Collection[str] | None = None,
        *,
        clocks: Mapping[str, ClockModel] | None = None,
        start_ns: int | None = None,
        spans_ns: Sequence[tuple[int, int]] | None = None,
    ) -> Iterator[DepthFrame]:
        """Yield the images in order of time; an image that cannot be unpacked is left out.

        Args:
            cameras: names; all where None. Unknown ones are ignored.
            clocks: clocks by camera: order by stage time; a camera without one counts by its own time.
            start_ns: first time, on the clock of the order (device or stage).
            spans_ns: only images between these times, ends included; all where None.
        """
        clocks = clocks or {}
        order = []
        for name in self._places if cameras is None else [n for n in self._places if n in cameras]:
            clock = clocks.get(name, ClockModel())
            for place in self._places[name]:
                time_ns = clock.stage_ns(place.device_time_ns)
                if start_ns is not None and time_ns < start_ns:
                    continue
                if spans_ns is None or any(begin <= time_ns <= end for begin, end in spans_ns):
                    order.append((time_ns, name, place))
        order.sort(key=lambda item: item[:2])
        with DepthReader(self) as reader:
            for _, name, place in order:
                frame = reader.frame(name, place)
                if frame is not None:
                    yield frame

    def place(self, camera: str, number: int) -> "_Place":
        """Return the place of a camera's image, by its number in `times_ns`."""
        return self._places[camera][number]


class DepthReader:
    """Reads images of a recording in any order; the chunks read last are kept. Close it, or use it with `with`.

    Raises:
        TakeError: the file cannot be opened.
    """

    def __init__(self, recording: DepthRecording) -> None:
        self.recording = recording
        self._chunks: OrderedDict[int, dict[tuple[int, int, int], bytes]] = OrderedDict()
        try:
            self._file = open(recording.path, "rb")
        except OSError as error:
            raise TakeError(unreadable(recording.path, error)) from error

    def __enter__(self) -> "DepthReader":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Close the file."""
        self._file.close()

    def image(self, camera: str, number: int) -> DepthFrame | None:
        """Return a camera's image by its number in `times_ns`; None if it cannot be unpacked, which the recording's
        `problem` then reports."""
        return self.frame(camera, self.recording.place(camera, number))

    def frame(self, name: str, place: _Place) -> DepthFrame | None:
        """Return the image at a place; None as for `image`."""
        recording = self.recording
        try:
            data = self._chunk(place.chunk_offset)[place.channel, place.publish_time, place.log_time]
            message = wire.decode(data)
            if not isinstance(message, wire.DepthImage):
                raise FormatError(
                    "raw.wrong_kind",
                    "a {kind} where a {wanted} belongs",
                    kind=type(message).__name__,
                    wanted="DepthImage",
                )
            depth_mm = wire.depth_array(message, recording.intrinsics[name])
        except (*DAMAGE, KeyError, FormatError) as error:
            recording.problem = recording.problem or f"a depth image of {name} cannot be read ({error})"
            return None
        return DepthFrame(name, place.sequence, place.device_time_ns, depth_mm)

    def _chunk(self, offset: int) -> dict[tuple[int, int, int], bytes]:
        if offset not in self._chunks:
            self._chunks[offset] = _read_chunk(self._file, offset)
            if len(self._chunks) > _CHUNKS_KEPT:
                self._chunks.popitem(last=False)
        return self._chunks[offset]


def placed_cameras(take: Path, recording: DepthRecording, calibration: Calibration) -> list[str]:
    """Return the cameras with depth that a calibration places, one at least.

    Raises:
        CalibrationError: there is none; the message names `take`.
    """
    names = [name for name in recording.cameras if name in calibration.cameras]
    if not names:
        raise CalibrationError(
            "depth.no_calibrated_camera",
            "the calibration of {take} has none of the cameras with depth ({names}); run `studio "
            "calibrate {take}`",
            take=take,
            names=[*recording.cameras],
        )
    return names


def index_depth(path: str | Path) -> DepthRecording:
    """Return the index of the depth images of a `raw.mcap`, for a process that reads the file for another.

    Raises:
        TakeError: no such file.
    """
    return DepthRecording(path)


def depth_frames(path: str | Path) -> Iterator[DepthFrame]:
    """Yield the depth images of a `raw.mcap` in order of device time, all cameras.

    Raises:
        TakeError: no such file.
    """
    return DepthRecording(path).frames()


def depth_cameras(path: str | Path) -> dict[str, DepthCamera]:
    """Return the intrinsics of the cameras of a `raw.mcap` with depth, by name; may be empty.

    Raises:
        TakeError: no such file.
    """
    return DepthRecording(path).cameras


def _read_chunk(file: IO[bytes], offset: int) -> dict[tuple[int, int, int], bytes]:
    """Return the messages of a chunk by channel, device time and arrival."""
    file.seek(offset)
    for record in StreamReader(file, skip_magic=True, emit_chunks=True).records:
        if isinstance(record, Chunk):
            return {
                (message.channel_id, message.publish_time, message.log_time): message.data
                for message in open_chunk(record)
                if isinstance(message, Message)
            }
    raise EOFError(say("raw.no_chunk", "no chunk at {offset}", offset=offset))
