"""The landmarks of a whole video."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from studio.engine.model.joints import JOINT_SETS
from studio.engine.seeing.pictures.poses import PoseFinder
from studio.take.video.file import VideoFile, no_frame
from studio.take.video.picture import small_picture

JOINT_SET = "mediapipe"


@dataclass(frozen=True)
class VideoLandmarks:
    """The landmarks of a video at each of its frames.

    Attributes:
        times_ns: since the video's beginning [ns], increasing, shape (frame_count,).
        sizes: width and height of each picture [pixels], shape (frame_count, 2).
        pixels: shape (frame_count, 33, 2), as in `FoundPose`; NaN = nobody is there.
        visibility: 0..1, shape (frame_count, 33).
        world_m: shape (frame_count, 33, 3), as in `FoundPose`; NaN = nobody is there.
        most_people: largest number of people in a picture.
        video: what its file says.
    """

    times_ns: NDArray[np.int64]
    sizes: NDArray[np.int64]
    pixels: NDArray[np.float64]
    visibility: NDArray[np.float64]
    world_m: NDArray[np.float64]
    most_people: int
    video: VideoFile


def landmarks_of(
    path: Path, model: str | Path = "full", *, progress: Callable[[float], None]
) -> VideoLandmarks:
    """Return the landmarks of a video file.

    Args:
        path: of the video.
        model: see `PoseFinder`.
        progress: receives the share done.

    Raises:
        FormatError: no video, or without a frame that can be read.
        NotAvailableError: as for `PoseFinder`.
    """
    video = VideoFile.open(path)
    finder = PoseFinder(model)
    count = len(JOINT_SETS[JOINT_SET])
    times_ns: list[int] = []
    sizes: list[tuple[int, int]] = []
    pixels, visibility, world_m = ([] for _ in range(3))
    people = 0
    for time_ns, frame in video.frames():
        picture = small_picture(frame)
        pose = finder.find(picture.image)
        times_ns.append(time_ns)
        sizes.append((picture.width, picture.height))
        pixels.append(np.full((count, 2), np.nan) if pose is None else picture.whole(pose.pixels))
        visibility.append(np.zeros(count) if pose is None else pose.visibility)
        world_m.append(np.full((count, 3), np.nan) if pose is None else pose.world_m)
        people = max(people, 0 if pose is None else pose.people)
        progress(min(time_ns * 1e-9 / video.duration_s, 1.0) if video.duration_s else 0.0)
    if not times_ns:
        raise no_frame(path)
    return VideoLandmarks(
        np.array(times_ns, np.int64),
        np.array(sizes, np.int64),
        np.array(pixels),
        np.array(visibility),
        np.array(world_m),
        people,
        video,
    )
