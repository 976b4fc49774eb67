"""A `raw.mcap` alone: every camera's skeletons and depth, without the live log."""

from pathlib import Path

import numpy as np

from studio import wire
from studio.engine.base.errors import FormatError
from studio.engine.base.sentences import about, say
from studio.engine.model.joints import JOINT_SETS
from studio.take.importers.recording import (
    DepthStream,
    Progress,
    ReadCamera,
    ReadDepth,
    ReadRecording,
)
from studio.take.raw.depth import DepthRecording
from studio.take.raw.frames import RawCamera, RawFrame, RawReader
from studio.take.raw.records import intrinsics_of


def matches(path: Path) -> bool:
    """Whether `path` is an `.mcap` file."""
    return path.is_file() and path.suffix.lower() == ".mcap"


def read(path: Path, progress: Progress) -> ReadRecording:
    """Return the content of a raw recording, damaged or not; hand states and head orientations are left out.

    Raises:
        FormatError: no camera in it.
    """
    reader = RawReader(path)
    hellos: dict[str, wire.Hello] = {}
    skeletons: dict[str, dict[int, wire.SkeletonFrame]] = {}
    for record in reader:
        if isinstance(record, RawCamera):
            hellos.setdefault(record.hello.name, record.hello)
        elif isinstance(record, RawFrame):
            of_camera = skeletons.setdefault(record.camera, {})
            of_camera.setdefault(record.message.device_time_ns, record.message)
    if not hellos:
        raise FormatError(
            "import.not_raw",
            "{path} is no recording of the studio: {error}",
            path=path,
            error=reader.problem or say("import.no_camera", "it has no camera"),
        )
    progress(0.5)
    depth = DepthRecording(path)
    notes = [f"{path.name}: {depth.problem}; what can be read was kept"] if depth.problem else []
    if any(m.hands or m.head_wxyz for of_camera in skeletons.values() for m in of_camera.values()):
        notes.append(f"{path.name}: hand states and head orientations were left out")
    cameras = tuple(
        _camera(hello, skeletons.get(name, {}), depth)
        for name, hello in hellos.items()
        if name in skeletons or name in depth.cameras
    )
    if not cameras:
        empty = say("import.no_frame", "{path} has no frame of any camera", path=path)
        raise FormatError(about(empty, depth.problem) if depth.problem else empty)
    progress(1.0)
    return ReadRecording(cameras=cameras, notes=notes)


def _camera(hello: wire.Hello, messages: dict[int, wire.SkeletonFrame], depth: DepthRecording) -> ReadCamera:
    times = sorted(messages)
    joints = [wire.joint_arrays(messages[time_ns], hello.joint_set) for time_ns in times]
    count = len(JOINT_SETS[hello.joint_set])
    return ReadCamera(
        name=hello.name,
        device=hello.device,
        joint_set=hello.joint_set,
        times_ns=np.array(times, dtype=np.int64),
        positions=np.array([positions for positions, _ in joints]).reshape(-1, count, 3),
        confidence=np.array([confidence for _, confidence in joints]).reshape(-1, count),
        serial=hello.serial,
        depth=raw_depth(hello, depth) if hello.name in depth.cameras else None,
        landmarks=_landmarks(hello, [messages[time_ns] for time_ns in times]),
    )


def _landmarks(hello: wire.Hello, messages: list[wire.SkeletonFrame]) -> list[wire.LandmarkArrays] | None:
    """Return the landmarks of a camera without depth; None = it has depth."""
    found = [wire.landmark_arrays(one, hello.joint_set) for one in messages]
    known = [one for one in found if one is not None]
    return known if known and len(known) == len(found) else None


def raw_depth(hello: wire.Hello, depth: DepthRecording) -> ReadDepth:
    """Return a camera's depth images in a raw recording."""

    def stream() -> DepthStream:
        for frame in depth.frames((hello.name,)):
            yield frame.device_time_ns, frame.depth_mm

    return ReadDepth(
        device=hello.device,
        intrinsics=intrinsics_of(depth.cameras[hello.name]),
        frame_count=len(depth.times_ns(hello.name)),
        frames_per_second=hello.frames_per_second,
        stream=stream,
        serial=hello.serial,
    )
