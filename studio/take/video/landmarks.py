"""The landmarks of a whole video."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from studio.engine.model.joints import JOINT_SETS
from studio.engine.seeing.pictures.poses import FoundPose, PoseFinder
from studio.take.video.file import VideoFile, no_frame
from studio.take.video.picture import SmallPicture, small_picture
from studio.wire import LandmarkArrays

JOINT_SET = "mediapipe"
LANDMARKS = len(JOINT_SETS[JOINT_SET])


@dataclass(frozen=True)
class VideoLandmarks:
    """The landmarks of a video at each of its frames.

    Attributes:
        times_ns: since the video's beginning [ns], increasing, shape (frame_count,).
        pictures: of 33 landmarks each; all are unseen where nobody is there.
        visibility: 0..1, shape (frame_count, 33).
        most_people: largest number of people in a picture.
        video: what its file says.
    """

    times_ns: NDArray[np.int64]
    pictures: list[LandmarkArrays]
    visibility: NDArray[np.float64]
    most_people: int
    video: VideoFile

    @property
    def somebody(self) -> NDArray[np.bool_]:
        """In which frames there is somebody, shape (frame_count,)."""
        return np.array([np.isfinite(picture.pixels).any() for picture in self.pictures])


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
    times_ns: list[int] = []
    pictures: list[LandmarkArrays] = []
    visibility: list[NDArray[np.float64]] = []
    people = 0
    for time_ns, frame in video.frames():
        picture = small_picture(frame)
        pose = finder.find(picture.image)
        times_ns.append(time_ns)
        pictures.append(landmarks_in(picture, pose))
        visibility.append(np.zeros(LANDMARKS) if pose is None else pose.visibility)
        people = max(people, 0 if pose is None else pose.people)
        progress(min(time_ns * 1e-9 / video.duration_s, 1.0) if video.duration_s else 0.0)
    if not times_ns:
        raise no_frame(path)
    return VideoLandmarks(np.array(times_ns, np.int64), pictures, np.array(visibility), people, video)


def landmarks_in(picture: SmallPicture, pose: FoundPose | None) -> LandmarkArrays:
    """Return the landmarks of a pose in the whole picture; all are unseen where there is none."""
    if pose is None:
        return LandmarkArrays(picture.width, picture.height, np.full((LANDMARKS, 2), np.nan))
    return LandmarkArrays(picture.width, picture.height, picture.whole(pose.pixels), pose.world_m)
