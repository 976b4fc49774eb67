"""The depth images of a take as skeletons, by the solve's `tracker` switch."""

from collections.abc import Callable, Iterator
from dataclasses import replace

from studio.engine.calibration.result import Calibration
from studio.engine.depth import DepthFrame
from studio.engine.errors import CalibrationError
from studio.engine.frames import CameraFrame
from studio.engine.settings import SolveSettings
from studio.engine.tracker.skeletons import POINTS, from_points, per_camera, points_calibration
from studio.take.raw import inspect_raw
from studio.take.raw_depth import DepthRecording
from studio.take.take import Take

Progress = Callable[[float], None]
_SHARE = 0.9
"""Of the time that a solve from depth takes, tracking takes about this share."""


def tracked_frames(
    take: Take, calibration: Calibration, settings: SolveSettings, progress: Progress | None = None
) -> tuple[dict[str, list[CameraFrame]], Calibration, SolveSettings] | None:
    """Return skeletons by camera, the calibration that places them, and the settings to solve them with.

    `tracker=points` gives one camera, `points`, that stands for all; `per_camera` one skeleton stream for every
    camera with depth. `client` asks for the skeletons as received, but where a take has none, it is tracked as
    clients would have done it.

    Returns:
        None where the skeletons are to be used as received: the switch says so, or the take has no depth.

    Raises:
        CalibrationError: none of the cameras has a transform. SettingsError: `cameras` names one that is not there.
    """
    summary = inspect_raw(take.raw_path)
    if not summary.depth_frames or (settings.tracker == "client" and any(summary.frames.values())):
        return None
    recording = DepthRecording(take.raw_path)
    placed = tuple(name for name in recording.cameras if name in calibration.cameras)
    if not placed:
        raise CalibrationError(
            f"the calibration of {take.path} has none of the cameras with depth ({', '.join(recording.cameras)}); "
            f"run `studio calibrate {take.path}`"
        )
    names = settings.camera_names(placed)
    cameras = {name: recording.cameras[name] for name in names}
    clocks = {name: calibration.cameras[name].clock for name in names}
    images = recording.frames(names, clocks=clocks)
    total = sum(len(recording.times_ns(name)) for name in names)
    images = _told(images, total, progress)
    if settings.tracker != "points":
        frames: dict[str, list[CameraFrame]] = {name: [] for name in names}
        for frame in per_camera(images, cameras):
            frames[frame.camera].append(frame)
        return frames, calibration, settings
    tracked = list(from_points(images, cameras, calibration))
    performer = tracked[-1][1] if tracked else None
    calibration = points_calibration(calibration, names, performer)
    return {POINTS: [frame for frame, _ in tracked]}, calibration, replace(settings, cameras="all")


def _told(images: Iterator[DepthFrame], total: int, progress: Progress | None) -> Iterator[DepthFrame]:
    """Pass images on and tell the share done."""
    for done, image in enumerate(images):
        if progress is not None and done % 16 == 0:
            progress(_SHARE * done / max(total, 1))
        yield image
