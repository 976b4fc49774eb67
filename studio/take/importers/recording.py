"""What an importer returns, and how it becomes a take."""

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from studio import wire
from studio.engine.calibration.result import Calibration
from studio.engine.errors import FormatError
from studio.take.new import new_take
from studio.take.raw import RawWriter
from studio.take.take import Take

Progress = Callable[[float], None]
"""Called with the share that is done, 0..1."""

_LATEST_NS = 2**62


@dataclass(frozen=True)
class ReadCamera:
    """One camera of a recording.

    Attributes:
        name: unique in the recording.
        device, joint_set, serial: as in `wire.Hello`.
        times_ns: capture times on the camera's own clock [ns], increasing, shape (frame_count,).
        positions: device joints in the camera frame (OpenCV axes) [m], shape (frame_count, joint_count, 3);
            NaN = unseen.
        confidence: 0..1, shape (frame_count, joint_count).
    """

    name: str
    device: str
    joint_set: str
    times_ns: NDArray[np.int64]
    positions: NDArray[np.float64]
    confidence: NDArray[np.float64]
    serial: str = ""

    def hello(self) -> wire.Hello:
        gaps_s = np.diff(self.times_ns) * 1e-9
        return wire.Hello(
            protocol_version=wire.PROTOCOL_VERSION,
            name=self.name,
            device=self.device,
            joint_set=self.joint_set,
            boot_id="import",
            serial=self.serial,
            frames_per_second=round(float(1.0 / np.median(gaps_s)), 3) if len(gaps_s) else 30.0,
        )


@dataclass(frozen=True)
class ReadRecording:
    """A whole recording, read and checked; `notes` says what was chosen or left out, one line each.

    `created` is ISO 8601 in UTC where the recording tells it.
    """

    cameras: tuple[ReadCamera, ...]
    calibration: Calibration | None = None
    calibration_s: float | None = None
    created: str | None = None
    notes: list[str] = field(default_factory=list)


def seconds_to_ns(seconds: float) -> int | None:
    """Return a time [s] in nanoseconds, or None where the wire format has no room for it (2**62 ns)."""
    time_ns = round(seconds * 1e9)
    return time_ns if abs(time_ns) <= _LATEST_NS else None


def put_in_order(name: str, times_ns: NDArray[np.int64], notes: list[str]) -> NDArray[np.int64]:
    """Return the indices of a camera's rows by time, each time once and none negative; note what was done.

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
        raise FormatError(f"{name} has no row at or after time 0; give times that are not negative")
    return index[early:]


def write_recording(recording: ReadRecording, out: Path, progress: Progress) -> Take:
    """Return the new take at `out`, with all frames in the order of their times.

    Raises:
        TakeError: `out` holds something already or cannot be written.
    """
    with new_take(
        out,
        source="import",
        calibration_s=recording.calibration_s,
        notes="\n".join(recording.notes),
        created=recording.created,
    ) as take:
        for camera in recording.cameras:
            take.add_camera(camera.hello())
        with RawWriter(take.raw_path) as writer:
            _write_frames(recording, writer, progress)
        if recording.calibration is not None:
            take.add_calibration(recording.calibration, use=True)
    return take


def _write_frames(recording: ReadRecording, writer: RawWriter, progress: Progress) -> None:
    for camera in recording.cameras:
        writer.add_camera(camera.hello())
    order = sorted(
        (int(time_ns), number, k)
        for number, camera in enumerate(recording.cameras)
        for k, time_ns in enumerate(camera.times_ns)
    )
    for done, (time_ns, number, k) in enumerate(order):
        camera = recording.cameras[number]
        data = wire.encode(wire.skeleton_frame(k, time_ns, camera.positions[k], camera.confidence[k]))
        writer.frame(camera.name, data, arrival_ns=time_ns, device_time_ns=time_ns, sequence=k)
        if done % 500 == 0:
            progress(done / len(order))
