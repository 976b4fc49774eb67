"""Playback of a recorded camera: a take, or any recording that `studio import` reads."""

import asyncio
from collections.abc import AsyncIterator
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Self

import numpy as np

from studio import wire
from studio.camera.sources.config import SourceConfig
from studio.camera.sources.depth_recording import DepthRecordingSource
from studio.camera.sources.pacing import WallClock
from studio.camera.sources.source import Source, SourceFrame
from studio.engine.base.errors import FormatError, SettingsError
from studio.engine.base.value_sentences import bad_value
from studio.take.folder.take import Take
from studio.take.importers import IMPORTERS
from studio.take.importers.raw_file import raw_depth
from studio.take.importers.recording import ReadCamera, ReadDepth
from studio.take.raw.depth import DepthRecording
from studio.take.raw.frames import RawCamera, RawFrame, read_raw

_PAUSE_NS = 500_000_000
"""Pause between two rounds."""

_SPEEDS = ("1", "max")


@dataclass
class RecordedCamera:
    """One camera of a recording: its device, its frames in order of their times, and its depth."""

    hello: wire.Hello
    frames: list[SourceFrame] = field(default_factory=list)
    depth: ReadDepth | None = None


@dataclass(frozen=True)
class RecordingConfig(SourceConfig):
    """One camera of a recording, `recording:<path>[#<camera>][?speed=max]`.

    Attributes:
        path: a take, or any recording that can be imported.
        camera: its name; "" = the only one.
        speed: "1" = in real time, in a loop; "max" = once, as fast as it is read.

    Raises:
        SettingsError: an unknown speed.
    """

    path: str | Path
    camera: str = ""
    speed: str = "1"

    def __post_init__(self) -> None:
        if self.speed not in _SPEEDS:
            raise SettingsError(bad_value("speed", repr(self.speed), _SPEEDS))

    @classmethod
    def parse(cls, text: str) -> Self:
        text, _, speed = text.partition("?speed=")
        path, _, camera = text.partition("#")
        return cls(path, camera, speed or "1")

    def open(self) -> "RecordingSource | DepthRecordingSource":
        """Return the source: of skeletons, or of images for a camera with depth only.

        Raises:
            SettingsError: a camera that the recording lacks, or must be named.
            FormatError, TakeError, NotAvailableError: a recording that cannot be read.
        """
        cameras, realtime = read_cameras(Path(self.path)), self.speed != "max"
        name = self.camera or (next(iter(cameras)) if len(cameras) == 1 else "")
        if name not in cameras:
            argument = f"{self.path}#{self.camera}" if self.camera else self.path
            raise SettingsError(
                "source.recording_camera",
                "source 'recording:{argument}' needs a camera of the recording, as "
                "recording:<path>#<camera>; it has {names}",
                argument=argument,
                names=[*cameras],
            )
        if not cameras[name].frames:
            depth = {n: c.depth for n, c in cameras.items() if c.depth is not None}
            return DepthRecordingSource(name, depth, realtime=realtime)
        cameras = {n: c for n, c in cameras.items() if c.frames}
        times = [(c.frames[0].device_time_ns, c.frames[-1].device_time_ns) for c in cameras.values()]
        first, last = min(begin for begin, _ in times), max(end for _, end in times)
        return RecordingSource(cameras[name], first, last - first + _PAUSE_NS, realtime=realtime)


def read_cameras(path: Path) -> dict[str, RecordedCamera]:
    """Return a recording's cameras with frames, by name.

    Raises:
        FormatError, TakeError, NotAvailableError: a recording that cannot be read, or has no frame.
    """
    cameras = _from_take(path) if (path / "take.json").is_file() else _from_import(path)
    cameras = {name: camera for name, camera in cameras.items() if camera.frames or camera.depth}
    if not cameras:
        raise FormatError(
            "import.no_frame_choose_other",
            "{path} has no frame of any camera; choose another recording",
            path=path,
        )
    for camera in cameras.values():
        camera.frames.sort(key=lambda frame: frame.device_time_ns)
    return cameras


def _from_take(path: Path) -> dict[str, RecordedCamera]:
    cameras: dict[str, RecordedCamera] = {}
    raw_path = Take.open(path).raw_path
    for record in read_raw(raw_path):
        if isinstance(record, RawCamera):
            cameras.setdefault(record.hello.name, RecordedCamera(record.hello))
        elif isinstance(record, RawFrame):
            camera = cameras[record.camera]
            first, *others = (_body(one, camera.hello.joint_set) for one in wire.each_body(record.message))
            camera.frames.append(replace(first, others=tuple(others)))
    recording = DepthRecording(raw_path)
    for name in recording.cameras:
        cameras[name].depth = raw_depth(cameras[name].hello, recording)
    return cameras


def _body(message: wire.SkeletonFrame, joint_set: str) -> SourceFrame:
    """Return one body of a frame."""
    positions, confidence = wire.joint_arrays(message, joint_set)
    return SourceFrame(
        message.device_time_ns,
        positions,
        confidence,
        tuple(message.hands),
        message.head_wxyz,
        picture=wire.landmark_arrays(message, joint_set),
        body=message.body,
    )


def _from_import(path: Path) -> dict[str, RecordedCamera]:
    if not path.exists():
        raise FormatError("import.none", "no recording at {path}: there is no such file or folder", path=path)
    importer = next((one for one in IMPORTERS.values() if one.matches(path)), None)
    if importer is None:
        kinds = [one.description for one in IMPORTERS.values()]
        raise FormatError(
            "import.unplayable_kind",
            "{path} is no recording that can be played; allowed: a take; {kinds}",
            path=path,
            kinds=kinds,
        )
    recording = importer.read(path, lambda _share: None)
    return {
        camera.name: RecordedCamera(
            camera.hello(),
            [_frame(camera, k, int(time_ns)) for k, time_ns in enumerate(camera.times_ns)],
            camera.depth,
        )
        for camera in recording.cameras
    }


def _frame(camera: ReadCamera, k: int, time_ns: int) -> SourceFrame:
    picture = None if camera.landmarks is None else camera.landmarks[k]
    return SourceFrame(time_ns, camera.positions[k], camera.confidence[k], picture=picture)


class RecordingSource(Source):
    """Plays one camera of a recording.

    In real time it loops in step with the wall clock, so that clients of the same recording
    play the same moment. Frames get new stamps from the wall clock, with the offsets between the recorded
    clocks. Otherwise it plays once, as fast as the link accepts it, with the recorded stamps.

    Args:
        camera: to play.
        first_ns: the earliest stamp of all cameras of the recording.
        period_ns: length of one round, the same for all cameras.
        realtime: see above.
    """

    def __init__(self, camera: RecordedCamera, first_ns: int, period_ns: int, *, realtime: bool) -> None:
        self.name = camera.hello.name
        self.device = camera.hello.device
        self.joint_set = camera.hello.joint_set
        self.frames_per_second = camera.hello.frames_per_second
        self.realtime = realtime
        self._frames = camera.frames
        self._first_ns = first_ns
        self._period_ns = period_ns
        self._wall = WallClock()
        self._newest_ns = camera.frames[0].device_time_ns

    def clock_ns(self) -> int:
        return self._wall.now_ns() if self.realtime else self._newest_ns

    async def frames(self) -> AsyncIterator[SourceFrame]:
        if not self.realtime:
            for frame in self._frames:
                self._newest_ns = frame.device_time_ns
                yield frame
                await asyncio.sleep(0)
            return
        times = np.array([frame.device_time_ns for frame in self._frames]) - self._first_ns
        now = self._wall.now_ns()
        round_ns = now - now % self._period_ns
        index = int(np.searchsorted(times, now - round_ns))
        while True:
            for k in range(index, len(times)):
                stamp = round_ns + int(times[k])
                await self._wall.wait_until(stamp)
                yield replace(self._frames[k], device_time_ns=stamp)
            index, round_ns = 0, round_ns + self._period_ns
