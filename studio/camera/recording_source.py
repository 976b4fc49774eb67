"""A recorded camera as a source: a take, or any recording that `studio import` reads, played back."""

import asyncio
from collections.abc import AsyncIterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from studio import wire
from studio.camera.depth_recording import DepthRecordingSource
from studio.camera.pacing import WallClock
from studio.camera.sources import SourceFrame
from studio.engine.errors import FormatError, SettingsError
from studio.take.importers import IMPORTERS
from studio.take.importers.raw_file import raw_depth
from studio.take.importers.recording import ReadDepth
from studio.take.raw import RawCamera, RawFrame, read_raw
from studio.take.raw_depth import DepthRecording
from studio.take.take import Take

_PAUSE_NS = 500_000_000
"""Between one round and the next."""

_SPEEDS = ("1", "max")


@dataclass
class RecordedCamera:
    """One camera of a recording: what it is, its frames in order of their times, and its depth."""

    hello: wire.Hello
    frames: list[SourceFrame] = field(default_factory=list)
    depth: ReadDepth | None = None


def open_recording(argument: str) -> "RecordingSource | DepthRecordingSource":
    """Return the source of `recording:<path>[#<camera>][?speed=max]`.

    A camera with skeletons plays these, one with depth alone its images.

    Raises:
        SettingsError: a camera that the recording does not have, or must be told; an unknown speed.
        FormatError, TakeError, NotAvailableError: a recording that cannot be read.
    """
    argument, _, speed = argument.partition("?speed=")
    path, _, name = argument.partition("#")
    if (speed or "1") not in _SPEEDS:
        raise SettingsError(f"speed {speed!r} is not allowed; allowed: {', '.join(_SPEEDS)}")
    cameras = read_cameras(Path(path))
    if not name and len(cameras) == 1:
        name = next(iter(cameras))
    if name not in cameras:
        raise SettingsError(
            f"source 'recording:{argument}' needs a camera of the recording, as recording:<path>#<camera>; "
            f"it has {', '.join(cameras)}"
        )
    if not cameras[name].frames:
        depth = {n: c.depth for n, c in cameras.items() if c.depth is not None}
        return DepthRecordingSource(name, depth, realtime=speed != "max")
    cameras = {n: c for n, c in cameras.items() if c.frames}
    times = [(c.frames[0].device_time_ns, c.frames[-1].device_time_ns) for c in cameras.values()]
    first, last = min(begin for begin, _ in times), max(end for _, end in times)
    return RecordingSource(cameras[name], first, last - first + _PAUSE_NS, realtime=speed != "max")


def read_cameras(path: Path) -> dict[str, RecordedCamera]:
    """Return a recording's cameras that have frames, by name.

    Raises:
        FormatError, TakeError, NotAvailableError: a recording that cannot be read, or has no frame.
    """
    cameras = _from_take(path) if (path / "take.json").is_file() else _from_import(path)
    cameras = {name: camera for name, camera in cameras.items() if camera.frames or camera.depth}
    if not cameras:
        raise FormatError(f"{path} has no frame of any camera; choose another recording")
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
            camera, message = cameras[record.camera], record.message
            positions, confidence = wire.joint_arrays(message, camera.hello.joint_set)
            camera.frames.append(
                SourceFrame(
                    message.device_time_ns, positions, confidence, tuple(message.hands), message.head_wxyz
                )
            )
    recording = DepthRecording(raw_path)
    for name in recording.cameras:
        cameras[name].depth = raw_depth(cameras[name].hello, recording)
    return cameras


def _from_import(path: Path) -> dict[str, RecordedCamera]:
    if not path.exists():
        raise FormatError(f"no recording at {path}: there is no such file or folder")
    importer = next((one for one in IMPORTERS.values() if one.matches(path)), None)
    if importer is None:
        kinds = "; ".join(one.description for one in IMPORTERS.values())
        raise FormatError(f"{path} is no recording that can be played; allowed: a take; {kinds}")
    recording = importer.read(path, lambda _share: None)
    return {
        camera.name: RecordedCamera(
            camera.hello(),
            [
                SourceFrame(int(time_ns), positions, confidence)
                for time_ns, positions, confidence in zip(
                    camera.times_ns, camera.positions, camera.confidence, strict=True
                )
            ],
            camera.depth,
        )
        for camera in recording.cameras
    }


class RecordingSource:
    """Plays one camera of a recording.

    In real time it plays over and over, in step with the wall clock, so that clients of the same recording
    started apart play the same moment; frames are stamped anew by the wall clock, and how far the recorded
    clocks are apart stays in the stamps. Otherwise it plays once, as fast as the link takes it, with the
    recorded stamps.

    Args:
        camera: what to play.
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
                frame = self._frames[k]
                yield SourceFrame(stamp, frame.positions, frame.confidence, frame.hands, frame.head_wxyz)
            index, round_ns = 0, round_ns + self._period_ns
