"""Skeleton frames from a take's depth images, for the pipeline."""

from collections.abc import Iterable, Iterator
from dataclasses import replace

import numpy as np

from studio.engine.base.geometry import make_transform
from studio.engine.model.calibration import Calibration, CameraCalibration, Performer
from studio.engine.model.cameras.depth import DepthCamera, DepthFrame
from studio.engine.model.frames import CameraFrame, ClockModel
from studio.engine.seeing.tracker.tracked import TrackedSkeleton
from studio.engine.seeing.tracker.tracker import Tracker

POINTS = "points"
"""Name of the virtual camera that stands for all cameras' points."""


def per_camera(frames: Iterable[DepthFrame], cameras: dict[str, DepthCamera]) -> Iterator[CameraFrame]:
    """Yield the skeletons of each image in its camera's frame, each camera tracked separately, as in the clients.

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
    """Yield skeletons from all cameras' points as frames of the camera `points`, each with the current estimate of
    the performer.

    Args:
        frames: of all cameras in order of stage time.
        cameras: intrinsics by name, of the cameras to use.
        calibration: their transforms and clocks; its `points_calibration` places the frames.
    """
    tracker = Tracker(cameras, {name: calibration.cameras[name].T_stage_camera for name in cameras})
    sets = frame_sets(frames, calibration, len(cameras))
    for number, (images, following) in enumerate(with_next(sets)):
        skeleton = tracker.track(images, following)
        yield points_frame(skeleton, number, calibration, cameras), tracker.performer


def points_frame(
    skeleton: TrackedSkeleton, number: int, calibration: Calibration, cameras: Iterable[str]
) -> CameraFrame:
    """Return the skeletons from all cameras' points as the frame `number` of the camera `points`."""
    eye = points_calibration(calibration, cameras, None).cameras[POINTS].T_stage_camera[:3, 3]
    placed = [replace(one, positions=one.positions - eye, others=()) for one in skeleton.each()]
    return _camera_frame(replace(placed[0], others=tuple(placed[1:])), POINTS, number, skeleton.time_ns)


def points_calibration(
    calibration: Calibration, cameras: Iterable[str], performer: Performer | None
) -> Calibration:
    """Return the calibration of the camera `points`: on the stage clock, with the stage's axes and the first
    camera's position.
    """
    eye = calibration.cameras[next(iter(cameras))].T_stage_camera[:3, 3]
    camera = CameraCalibration(T_stage_camera=make_transform(np.eye(3), eye))
    return Calibration(reference=POINTS, cameras={POINTS: camera}, performer=performer)


def frame_sets(
    frames: Iterable[DepthFrame], calibration: Calibration, camera_count: int
) -> Iterator[dict[str, DepthFrame]]:
    """Yield sets of images of one period, at most one per camera, on the stage clock.

    Args:
        frames: of all cameras in order of stage time.
        camera_count: number of images in a complete set.
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


def with_next(
    sets: Iterable[dict[str, DepthFrame]],
) -> Iterator[tuple[dict[str, DepthFrame], dict[str, DepthFrame] | None]]:
    """Yield each set of images with the next set, which is None after the last."""
    present: dict[str, DepthFrame] | None = None
    for following in sets:
        if present is not None:
            yield present, following
        present = following
    if present is not None:
        yield present, None


def _camera_frame(skeleton: TrackedSkeleton, camera: str, sequence: int, time_ns: int) -> CameraFrame:
    first, *others = [
        CameraFrame(camera, sequence, time_ns, one.positions, one.confidence, body=one.body)
        for one in skeleton.each()
    ]
    return replace(first, others=tuple(others)) if others else first
