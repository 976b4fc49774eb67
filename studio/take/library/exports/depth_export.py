"""Export of a camera's depth for other programs."""

from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from studio.engine.base.errors import TakeError
from studio.take.folder.take import Take
from studio.take.library.exports.k4a_writer import write_k4a
from studio.take.raw.depth import DepthRecording


def export_depth(
    take: Take, out: Path, camera: str | None = None, *, progress: Callable[[float], None] | None = None
) -> tuple[str, int]:
    """Write one camera's depth images as an Azure Kinect recording (`.mkv`); return the camera and the number of
    images.

    Args:
        camera: its name; may be left out if only one camera has depth.
        progress: called with the share done, 0..1.

    Raises:
        TakeError: the take has no depth, or none of that camera, or several cameras have some.
        FormatError: the device has no depth mode with images of that size.
    """
    recording = DepthRecording(take.raw_path)
    name = choose_camera(take, list(recording.cameras), camera)
    total = len(recording.times_ns(name))

    def images() -> Iterator[tuple[int, NDArray[np.uint16]]]:
        for k, frame in enumerate(recording.frames([name])):
            if progress is not None:
                progress(k / total)
            yield frame.device_time_ns, frame.depth_mm

    serial = next((c["serial"] for c in take.meta.get("cameras", []) if c.get("name") == name), "")
    return name, write_k4a(out, recording.cameras[name], images(), serial=serial)


def choose_camera(take: Take, names: Sequence[str], camera: str | None) -> str:
    """Return the camera to export, of those with depth.

    Raises:
        TakeError: as `export_depth`.
    """
    if not names:
        raise TakeError(
            "depth.none",
            "take {take} has no depth; record with `studio camera --record-depth`",
            take=take.path,
        )
    if camera is None and len(names) > 1:
        raise TakeError(
            "depth.choose_camera",
            "take {take} has depth of {names}; choose one with --camera",
            take=take.path,
            names=[*names],
        )
    name = names[0] if camera is None else camera
    if name not in names:
        raise TakeError(
            "depth.no_such_camera",
            "take {take} has no depth of camera {name!r}; it has: {names}",
            take=take.path,
            name=name,
            names=[*names],
        )
    return name
