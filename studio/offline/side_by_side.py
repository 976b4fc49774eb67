"""Tracking of a take's cameras, each by itself: in parallel processes, or image by image in this one."""

from collections.abc import Callable, Iterable, Iterator

from studio.engine.base.system import core_count
from studio.engine.model.cameras.depth import DepthFrame
from studio.engine.model.frames import CameraFrame
from studio.engine.seeing.tracker.skeletons import per_camera
from studio.take.folder.take import Take
from studio.take.raw.depth import DepthRecording
from studio.worker.several import run_several

Progress = Callable[[float], None]

WORTH_IMAGES = 300
"""Number of images from which processes save more time than they take to load."""

_TOLD_EVERY = 16


def track_cameras(
    take: Take,
    recording: DepthRecording,
    names: tuple[str, ...],
    progress: Progress | None = None,
    *,
    processes: int | None = None,
) -> dict[str, list[CameraFrame]]:
    """Return each camera's own skeletons in order of time, the same to the last bit in one process or in several.

    Args:
        take: whose depth `recording` is.
        names: of cameras with depth.
        progress: receives the share done; what it raises ends all processes.
        processes: maximum number; None = two for each core that this one may use, so that three cameras keep two
            cores busy to the end, but one on a single core.

    Raises:
        StudioError: a process broke off; the message says what to do.
    """
    if processes is None:
        processes = 2 * core_count() if core_count() > 1 else 1
    count = min(processes, len(names))
    if count > 1 and sum(len(recording.times_ns(name)) for name in names) >= WORTH_IMAGES:
        works = {name: (take, name) for name in names}
        return run_several(
            "studio.offline.side_by_side:track_camera", works, processes=count, progress=progress
        )
    found: dict[str, list[CameraFrame]] = {name: [] for name in names}
    images = told(recording, recording.frames(names), names, progress)
    for frame in per_camera(images, {name: recording.cameras[name] for name in names}):
        found[frame.camera].append(frame)
    return found


def track_camera(take: Take, camera: str, *, progress: Progress) -> list[CameraFrame]:
    """Return one camera's skeletons in order of time, in a process of its own."""
    recording = DepthRecording(take.raw_path)
    images = told(recording, recording.frames((camera,)), (camera,), progress)
    return list(per_camera(images, {camera: recording.cameras[camera]}))


def told(
    recording: DepthRecording, images: Iterator[DepthFrame], names: Iterable[str], progress: Progress | None
) -> Iterator[DepthFrame]:
    """Pass on the cameras' images and report the share done."""
    total = sum(len(recording.times_ns(name)) for name in names)
    for done, image in enumerate(images):
        if progress is not None and done % _TOLD_EVERY == 0:
            progress(done / max(total, 1))
        yield image
