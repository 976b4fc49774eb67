"""A take's depth images as skeleton frames, which the pipeline takes like any camera's."""

from collections.abc import Iterable, Iterator
from dataclasses import replace

import numpy as np

from studio.engine.calibration.result import Calibration, CameraCalibration, Performer
from studio.engine.depth import DepthCamera, DepthFrame
from studio.engine.frames import CameraFrame, ClockModel
from studio.engine.geometry import make_transform
from studio.engine.tracker.tracked import TrackedSkeleton
from studio.engine.tracker.tracker import Tracker

POINTS = "points"
"""Name of the camera that stands for all cameras' points."""


def per_camera(frames: Iterable[DepthFrame], cameras: dict[str, DepthCamera]) -> Iterator[CameraFrame]:
    """Yield the skeleton of each image in its camera's frame, every camera tracked on its own, as clients do.

    Args:
        frames: of all cameras, each camera's in order of time.
        cameras: intrinsics by name.
    """
    trackers = {name: Tracker({name: camera}) for name, camera in cameras.items()}
    for frame in frames:
        skeleton = trackers[frame.camera].track({frame.camera: frame})
        yield _camera_frame(skeleton, frame.camera, frame.sequence, frame.device_time_ns)


def from_points(
    frames: Iterable[DepthFrame], cameras: dict[str, DepthCamera], calibration: Calibration
) -> Iterator[tuple[CameraFrame, Performer]]:
    """Yield one skeleton of all cameras' points after another, as frames of the camera `points`, and the performer as
    known by then.

    Args:
        frames: of all cameras in order of stage time.
        cameras: intrinsics by name, of the cameras to use.
        calibration: their transforms and clocks; `points_calibration` of it places the frames.
    """
    tracker = Tracker(cameras, {name: calibration.cameras[name].T_stage_camera for name in cameras})
    eye = points_calibration(calibration, cameras, None).cameras[POINTS].T_stage_camera[:3, 3]
    for number, images in enumerate(frame_sets(frames, calibration, len(cameras))):
        skeleton = tracker.track(images)
        frame = _camera_frame(skeleton, POINTS, number, skeleton.time_ns)
        yield replace(frame, positions=frame.positions - eye), tracker.performer


def points_calibration(
    calibration: Calibration, cameras: Iterable[str], performer: Performer | None
) -> Calibration:
    """Return the calibration of the camera `points`: on the stage clock, its axes the stage's, its place the first
    camera's."""
    eye = calibration.cameras[next(iter(cameras))].T_stage_camera[:3, 3]
    camera = CameraCalibration(T_stage_camera=make_transform(np.eye(3), eye))
    return Calibration(reference=POINTS, cameras={POINTS: camera}, performer=performer)


def frame_sets(
    frames: Iterable[DepthFrame], calibration: Calibration, camera_count: int
) -> Iterator[dict[str, DepthFrame]]:
    """Yield images that were taken within one period, at most one per camera, on the stage clock.

    Args:
        frames: of all cameras in order of stage time.
        camera_count: a set of so many is complete.
    """
    images: dict[str, DepthFrame] = {}
    for frame in frames:
        clock = (
            calibration.cameras[frame.camera].clock if frame.camera in calibration.cameras else ClockModel()
        )
        if frame.camera in images:
            yield images
            images = {}
        images[frame.camera] = replace(frame, device_time_ns=clock.stage_ns(frame.device_time_ns))
        if len(images) == camera_count:
            yield images
            images = {}
    if images:
        yield images


def _camera_frame(skeleton: TrackedSkeleton, camera: str, sequence: int, time_ns: int) -> CameraFrame:
    return CameraFrame(camera, sequence, time_ns, skeleton.positions, skeleton.confidence)
