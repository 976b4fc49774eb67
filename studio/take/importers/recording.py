"""The result of an importer, and its conversion to a take."""

import heapq
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from studio import wire
from studio.engine.base.errors import FormatError
from studio.engine.model.calibration import Calibration
from studio.engine.model.joints import JOINT_COUNT
from studio.take.folder.new import new_take
from studio.take.folder.take import Take
from studio.take.raw.frames import RawWriter
from studio.take.video.kept import keep_video

Progress = Callable[[float], None]
"""Called with the share done, 0..1."""

_LATEST_NS = 2**62


DepthStream = Iterator[tuple[int, NDArray[np.uint16]]]
"""Capture time on the camera's clock [ns], increasing, and depth [mm], shape (height, width), 0 = no reading."""


@dataclass(frozen=True)
class ReadDepth:
    """A camera's depth images, not read yet.

    Attributes:
        device: the camera's device.
        intrinsics: of every image.
        frame_count: as announced; a damaged recording has fewer.
        frames_per_second: nominal or measured.
        stream: starts to read; damaged images are left out and noted in the recording's notes.
        serial: of the device, where known.
    """

    device: str
    intrinsics: wire.Intrinsics
    frame_count: int
    frames_per_second: float
    stream: Callable[[], DepthStream]
    serial: str = ""


@dataclass(frozen=True)
class ReadVideo:
    """The video that a camera's landmarks were read from.

    Attributes:
        path: its file.
        at_ns: time of each frame in the file [ns], shape (frame_count,); the camera's `times_ns` are the capture
            times.
    """

    path: Path
    at_ns: NDArray[np.int64]


@dataclass(frozen=True)
class OtherBody:
    """A further body in a frame: the device's own number, joints and confidence as of `ReadCamera`, of one frame."""

    number: int
    positions: NDArray[np.float64]
    confidence: NDArray[np.float64]


@dataclass(frozen=True)
class ReadCamera:
    """One camera of a recording: skeletons, depth images, both, or landmarks in pictures.

    Attributes:
        name: unique in the recording.
        device, joint_set, serial: as in `wire.Hello`.
        times_ns: capture times on the camera's own clock [ns], increasing, shape (frame_count,).
        positions: device joints in the camera frame (OpenCV axes) [m], shape (frame_count, joint_count, 3);
            NaN = unseen.
        confidence: 0..1, shape (frame_count, joint_count).
        body: the device's number of each frame's body, shape (frame_count,); None = 0 throughout.
        others: further bodies of each frame; None = none.
        depth: its depth images, where it has any.
        landmarks: of each frame of a camera without depth, whose `positions` are NaN; `confidence` is how visible
            they are.
        clock_within_s: maximum offset of its clock from that of the other cameras with this [s]; None = own clock.
        video: the video in which the landmarks were found, if there is one.
    """

    name: str
    device: str
    joint_set: str
    times_ns: NDArray[np.int64]
    positions: NDArray[np.float64]
    confidence: NDArray[np.float64]
    serial: str = ""
    body: NDArray[np.int64] | None = None
    others: Sequence[Sequence[OtherBody]] | None = None
    depth: ReadDepth | None = None
    landmarks: Sequence[wire.LandmarkArrays] | None = None
    clock_within_s: float | None = None
    video: ReadVideo | None = None

    @staticmethod
    def of_depth(name: str, depth: ReadDepth) -> "ReadCamera":
        """Return a camera with depth only."""
        return ReadCamera(
            name=name,
            device=depth.device,
            joint_set="canonical",
            times_ns=np.empty(0, dtype=np.int64),
            positions=np.empty((0, JOINT_COUNT, 3)),
            confidence=np.empty((0, JOINT_COUNT)),
            serial=depth.serial,
            depth=depth,
        )

    def hello(self) -> wire.Hello:
        gaps_s = np.diff(self.times_ns) * 1e-9
        frames_per_second = self.depth.frames_per_second if self.depth is not None else 30.0
        return wire.Hello(
            protocol_version=wire.PROTOCOL_VERSION,
            name=self.name,
            device=self.device,
            joint_set=self.joint_set,
            boot_id="import",
            serial=self.serial,
            frames_per_second=round(float(1.0 / np.median(gaps_s)) if len(gaps_s) else frames_per_second, 3),
            intrinsics=self.depth.intrinsics if self.depth is not None else None,
        )


@dataclass(frozen=True)
class ReadRecording:
    """A whole recording, read and checked; `notes` lists choices and omissions, one line each.

    `created` is ISO 8601 in UTC, if the recording has it.
    """

    cameras: tuple[ReadCamera, ...]
    calibration: Calibration | None = None
    calibration_s: float | None = None
    created: str | None = None
    notes: list[str] = field(default_factory=list)


def seconds_to_ns(seconds: float) -> int | None:
    """Return a time [s] in nanoseconds, or None beyond the wire format's range (2**62 ns)."""
    time_ns = round(seconds * 1e9)
    return time_ns if abs(time_ns) <= _LATEST_NS else None


def put_in_order(name: str, times_ns: NDArray[np.int64], notes: list[str]) -> NDArray[np.int64]:
    """Return the indices of a camera's rows by time, each time once and none negative; add notes on changes.

    Raises:
        FormatError: no row is left.
    """
    backwards = int((np.diff(times_ns) < 0).sum())
    if backwards:
        notes.append(
            f"{name}: time goes backwards at {backwards} of {len(times_ns)} rows; rows were sorted by time"
        )
    unique_ns, index = np.unique(times_ns, return_index=True)
    if len(unique_ns) < len(times_ns):
        notes.append(f"{name}: {len(times_ns) - len(unique_ns)} rows repeat a time and were left out")
    early = int((unique_ns < 0).sum())
    if early:
        notes.append(f"{name}: {early} rows before time 0 were left out")
    if early == len(unique_ns):
        raise FormatError(
            "import.no_row_from_zero",
            "{path} has no row at or after time 0; give times that are not negative",
            path=name,
        )
    return index[early:]


def write_recording(
    recording: ReadRecording, out: Path, progress: Progress, *, keep_videos: bool = True
) -> Take:
    """Return the new take at `out`, with all frames in the order of their times, and the videos of its cameras.

    Raises:
        FormatError: no frame of a camera can be read.
        TakeError: `out` is not empty or cannot be written.
    """
    with new_take(
        out,
        source="import",
        calibration_s=recording.calibration_s,
        created=recording.created,
    ) as take:
        for camera in recording.cameras:
            take.add_camera(camera.hello(), clock_within_s=camera.clock_within_s)
        with RawWriter(take.raw_path) as writer:
            _write_frames(recording, writer, progress)
        for camera in recording.cameras if keep_videos else ():
            if camera.video is not None:
                keep_video(
                    take, camera.video.path, camera=camera.name, boot_id=camera.hello().boot_id,
                    at_ns=camera.video.at_ns, times_ns=camera.times_ns,
                )  # fmt: skip
        take.meta["notes"] = "\n".join(recording.notes)
        if recording.calibration is not None:
            take.add_calibration(recording.calibration, use=True)
    return take


def _write_frames(recording: ReadRecording, writer: RawWriter, progress: Progress) -> None:
    for camera in recording.cameras:
        writer.add_camera(camera.hello())
    announced = sum(len(c.times_ns) + (c.depth.frame_count if c.depth else 0) for c in recording.cameras)
    streams = [
        messages(number, camera)
        for number, camera in enumerate(recording.cameras)
        for messages in (_skeletons, _depth_images)
    ]
    written = [0] * len(recording.cameras)
    for done, (time_ns, number, kind, message) in enumerate(heapq.merge(*streams, key=lambda m: m[:3])):
        write = writer.depth if kind == "depth" else writer.frame
        name = recording.cameras[number].name
        data = wire.encode(message)
        write(name, data, arrival_ns=time_ns, device_time_ns=time_ns, sequence=message.sequence)
        written[number] += 1
        if done % 100 == 0:
            progress(min(done / max(announced, 1), 1.0))
    for camera, count in zip(recording.cameras, written, strict=True):
        if not count:
            reasons = "; ".join(recording.notes) or "it has none"
            raise FormatError(
                "import.no_frame_readable",
                "no frame of {path} can be read: {error}",
                path=camera.name,
                error=reasons,
            )


_Item = tuple[int, int, str, wire.SkeletonFrame | wire.DepthImage]


def _skeletons(number: int, camera: ReadCamera) -> Iterator[_Item]:
    for k, time_ns in enumerate(camera.times_ns.tolist()):
        yield time_ns, number, "skeleton", _frame(k, time_ns, camera)


def _frame(k: int, time_ns: int, camera: ReadCamera) -> wire.SkeletonFrame:
    if camera.landmarks is None:
        number = 0 if camera.body is None else int(camera.body[k])
        frame = wire.skeleton_frame(k, time_ns, camera.positions[k], camera.confidence[k], body=number)
        others = () if camera.others is None else camera.others[k]
        return wire.with_others(
            frame,
            [
                wire.skeleton_frame(k, time_ns, one.positions, one.confidence, body=one.number)
                for one in others
            ],
        )
    return wire.landmark_frame(k, time_ns, camera.landmarks[k], camera.confidence[k])


def _depth_images(number: int, camera: ReadCamera) -> Iterator[_Item]:
    """Yield a camera's depth images; one at the time of a skeleton has its number, others continue the count."""
    if camera.depth is None:
        return
    numbers = {time_ns: k for k, time_ns in enumerate(camera.times_ns.tolist())}
    free = len(numbers)
    for time_ns, depth_mm in camera.depth.stream():
        sequence = numbers.get(time_ns, free)
        free += sequence == free
        yield time_ns, number, "depth", wire.depth_image(sequence, time_ns, depth_mm)
