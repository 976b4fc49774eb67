"""Azure Kinect recordings (`.mkv`), read with PyAV: depth track, factory calibration, device times."""

import os
from collections.abc import Iterator
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from studio.engine.base.errors import FormatError
from studio.engine.base.sentences import about
from studio.take.importers.k4a import intrinsics
from studio.take.importers.recording import DepthStream, Progress, ReadCamera, ReadDepth, ReadRecording

if TYPE_CHECKING:
    from av.container import InputContainer
    from av.video.stream import VideoStream

DEVICE = "Azure Kinect"


def matches(path: Path) -> bool:
    """Whether `path` is an `.mkv` file."""
    return path.is_file() and path.suffix.lower() == ".mkv"


def read(path: Path, progress: Progress) -> ReadRecording:
    """Return the recording of one camera, named `camera_0`; images are read when it is written.

    Raises:
        FormatError: not a Matroska file, or without a depth track or calibration.
    """
    notes: list[str] = []
    cameras, created = read_cameras(path, notes)
    progress(1.0)
    return ReadRecording(cameras=cameras, created=created, notes=notes)


def read_cameras(path: Path, notes: list[str]) -> tuple[tuple[ReadCamera, ...], str | None]:
    """Return the one camera of a file, and the file's time of creation (ISO 8601).

    Damage is noted when the stream is read.

    Raises:
        FormatError: not a Matroska file, or without a depth track or calibration.
    """
    with _open(path) as container:
        track = _depth_track(path, container)
        mode = track.metadata.get("K4A_DEPTH_MODE", "")
        calibration = [
            s for s in container.streams.attachments if s.metadata.get("filename", "") == "calibration.json"
        ]
        if not calibration:
            raise FormatError(
                "import.k4a_no_calibration",
                "{path} has no calibration.json inside; is it a recording of an Azure Kinect?",
                path=path,
            )
        try:
            camera = intrinsics(calibration[0].data, mode)
        except FormatError as error:
            raise FormatError(about(str(path), error.sentence)) from error
        size = (track.codec_context.width, track.codec_context.height)
        if size != (camera.width, camera.height):
            raise FormatError(
                "import.k4a_damaged",
                "{path}: images of {width} x {height} in depth mode {mode}; the file is damaged",
                path=path,
                width=size[0],
                height=size[1],
                mode=mode,
            )
        rate = float(track.average_rate or 30)
        seconds = (container.duration or 0) * 1e-6
        metadata = dict(container.metadata)
    depth = ReadDepth(
        device=DEVICE,
        intrinsics=camera,
        frame_count=max(round(seconds * rate), 1),
        frames_per_second=rate,
        stream=lambda: _stream(path, notes),
        serial=metadata.get("K4A_DEVICE_SERIAL_NUMBER", ""),
    )
    return (ReadCamera.of_depth("camera_0", depth),), _created(metadata.get("creation_time", ""))


def _open(path: Path) -> "InputContainer":
    import av
    from av.error import FFmpegError

    lenient: dict[str, Any] = (
        {"metadata_errors": "replace"} if int(av.__version__.split(".")[0]) < 19 else {}
    )  # as 19 is by itself
    try:
        return av.open(str(path), "r", format="matroska", **lenient)
    except (FFmpegError, OSError) as error:
        raise FormatError(
            "import.not_matroska",
            "{path} cannot be read as a Matroska file ({error})",
            path=path,
            error=error.strerror,
        ) from error


def _depth_track(path: Path, container: "InputContainer") -> "VideoStream":
    for track in container.streams.video:
        if "K4A_DEPTH_MODE" in track.metadata or track.metadata.get("title") == "DEPTH":
            return track
    raise FormatError(
        "import.no_depth_track", "{path} has no depth track; record with the depth camera on", path=path
    )


def _stream(path: Path, notes: list[str]) -> DepthStream:
    count, newest_ns, late = 0, -1, 0
    with _open(path) as container:
        track = _depth_track(path, container)
        start = container.metadata.get("K4A_START_OFFSET_NS", "0")
        start_ns = int(start) if start.isascii() and start.isdigit() and len(start) < 19 else 0
        for item in _images(container, track):
            if isinstance(item, str):
                notes.append(f"{path.name} is cut or damaged after {count} images ({item}); they were kept")
                return
            pts_ns, depth_mm = item
            time_ns = start_ns + pts_ns
            if time_ns <= newest_ns:
                late += 1
                continue
            newest_ns = time_ns
            count += 1
            yield time_ns, depth_mm
    if not _is_finished(path):
        notes.append(f"{path.name} was cut or not finished; the {count} images that it holds were kept")
    if late:
        notes.append(f"{path.name}: {late} images whose time does not advance were left out")


def _images(container: "InputContainer", track: Any) -> Iterator[tuple[int, NDArray[np.uint16]] | str]:
    """Yield time since the start [ns] and depth [mm]; for a damaged file, a text last."""
    from av.error import FFmpegError

    shape = (track.codec_context.height, track.codec_context.width)
    packets = container.demux(track)
    while True:
        try:
            packet = next(packets)
            if packet.pts is None or packet.size == 0:
                continue
            pts_ns = round(packet.pts * packet.time_base * 1_000_000_000)
            data = bytes(packet)
        except StopIteration:
            return
        except FFmpegError as error:
            yield error.strerror or "damaged"
            return
        if packet.is_corrupt or len(data) != 2 * shape[0] * shape[1]:
            yield "an image is cut"
            return
        yield pts_ns, np.frombuffer(data, dtype=">u2").reshape(shape).astype(np.uint16)


def _is_finished(path: Path) -> bool:
    """Whether the file states its length and has it; a recorder writes it at the end (RFC 9559, RFC 8794)."""
    length, size, begin = 1, 0, 0
    with open(path, "rb") as file:
        for _ in range(2):  # the EBML header, then the segment
            file.seek(4, os.SEEK_CUR)
            first = file.read(1)
            if not first or not first[0]:
                return False
            length = 9 - first[0].bit_length()
            size = int.from_bytes(first + file.read(length - 1), "big") ^ (1 << 7 * length)
            begin = file.tell()
            file.seek(size, os.SEEK_CUR)
    return size != (1 << 7 * length) - 1 and begin + size <= path.stat().st_size


def _created(text: str) -> str | None:
    try:
        time = datetime.fromisoformat(text)
    except ValueError:
        return None
    return time.astimezone(UTC).isoformat(timespec="seconds")
