"""Cameras of a take that are tracked each for itself: side by side in processes, or one after the other's image."""

import threading
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import FIRST_EXCEPTION, Future, ThreadPoolExecutor, wait
from functools import partial

from studio.engine.base.system import core_count
from studio.engine.model.depth import DepthFrame
from studio.engine.model.frames import CameraFrame
from studio.engine.seeing.tracker.skeletons import per_camera
from studio.take.folder.take import Take
from studio.take.raw.depth import DepthRecording
from studio.worker import Stopped, run_in_process

Progress = Callable[[float], None]

WORTH_IMAGES = 300
"""With fewer images, a process would be loading longer than it spares."""

_TOLD_EVERY, _TOLD_S = 16, 0.2


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
        processes: at most so many; None = as many as this one may use cores.

    Raises:
        StudioError: a process broke off; what to do.
    """
    count = min(core_count() if processes is None else processes, len(names))
    if count > 1 and sum(len(recording.times_ns(name)) for name in names) >= WORTH_IMAGES:
        return _in_processes(take, names, count, progress)
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


def _in_processes(
    take: Take, names: tuple[str, ...], count: int, progress: Progress | None
) -> dict[str, list[CameraFrame]]:
    stop = threading.Event()
    shares = dict.fromkeys(names, 0.0)
    with ThreadPoolExecutor(count) as pool:
        works: dict[str, Future[list[CameraFrame]]] = {
            name: pool.submit(
                run_in_process,
                "studio.offline.side_by_side:track_camera",
                take,
                name,
                on_progress=partial(shares.__setitem__, name),
                should_stop=stop.is_set,
                spare=False,
                inherits=True,
            )
            for name in names
        }
        try:
            while not _over(works, _TOLD_S):
                if progress is not None:
                    progress(sum(shares.values()) / len(shares))
        finally:
            stop.set()
            pool.shutdown(cancel_futures=True)
    broken = [
        error for work in works.values() if not work.cancelled() and (error := work.exception()) is not None
    ]
    for error in sorted(broken, key=lambda error: isinstance(error, Stopped)):
        raise error  # what went wrong first, before what was stopped for it
    return {name: work.result() for name, work in works.items()}


def _over(works: dict[str, Future[list[CameraFrame]]], seconds: float) -> bool:
    """Wait for some seconds; return whether all is done, or something went wrong."""
    done, left = wait(works.values(), timeout=seconds, return_when=FIRST_EXCEPTION)
    return not left or any(work.exception() is not None for work in done)


def told(
    recording: DepthRecording, images: Iterator[DepthFrame], names: Iterable[str], progress: Progress | None
) -> Iterator[DepthFrame]:
    """Pass on the cameras' images and report the share done."""
    total = sum(len(recording.times_ns(name)) for name in names)
    for done, image in enumerate(images):
        if progress is not None and done % _TOLD_EVERY == 0:
            progress(done / max(total, 1))
        yield image
