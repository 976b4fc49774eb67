"""The landmarks of a whole video."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from studio.engine.model.joints import JOINT_SETS
from studio.engine.seeing.pictures.hands import HandFinder
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
        video: facts from its file.
    """

    times_ns: NDArray[np.int64]
    pictures: list[LandmarkArrays]
    visibility: NDArray[np.float64]
    most_people: int
    video: VideoFile

    @property
    def somebody(self) -> NDArray[np.bool_]:
        """Whether somebody is in each frame, shape (frame_count,)."""
        return np.array([np.isfinite(picture.pixels).any() for picture in self.pictures])


def landmarks_of(
    path: Path, model: str | Path = "full", hands: bool = True, *, progress: Callable[[float], None]
) -> VideoLandmarks:
    """Return the landmarks of a video file.

    Args:
        path: of the video.
        model: see `PoseFinder`.
        hands: look for the hands too.
        progress: receives the share done.

    Raises:
        FormatError: no video, or without a frame that can be read.
        NotAvailableError: as for `PoseFinder`.
    """
    video = VideoFile.open(path)
    reader = LandmarkReader(model, hands=hands)
    times_ns: list[int] = []
    pictures: list[LandmarkArrays] = []
    visibility: list[NDArray[np.float64]] = []
    people = 0
    for time_ns, frame in video.frames():
        seen, pose = reader.read(small_picture(frame))
        times_ns.append(time_ns)
        pictures.append(seen)
        visibility.append(np.zeros(LANDMARKS) if pose is None else pose.visibility)
        people = max(people, 0 if pose is None else pose.people)
        progress(min(time_ns * 1e-9 / video.duration_s, 1.0) if video.duration_s else 0.0)
    if not times_ns:
        raise no_frame(path)
    return VideoLandmarks(np.array(times_ns, np.int64), pictures, np.array(visibility), people, video)


class LandmarkReader:
    """Finds the landmarks of one person in the pictures of one camera, in their order; used by one thread at a time.

    Args:
        model: see `PoseFinder`.
        hands: look for the hands too.

    Raises:
        SettingsError, FormatError, NotAvailableError: as for `PoseFinder`.
    """

    def __init__(self, model: str | Path = "full", *, hands: bool = True) -> None:
        self._finder = PoseFinder(model)
        self._hands = HandFinder() if hands else None

    def read(self, picture: SmallPicture) -> tuple[LandmarkArrays, FoundPose | None]:
        """Return the landmarks in the whole picture, all unseen where nobody is, and the pose; None = nobody."""
        pose = self._finder.find(picture.image)
        if pose is None:
            if self._hands is not None:
                self._hands.forget()
            return LandmarkArrays(picture.width, picture.height, np.full((LANDMARKS, 2), np.nan)), None
        hands: list[NDArray[np.float64] | None] = [None, None]
        if self._hands is not None:
            hands = self._hands.find(picture.image, pose.pixels, pose.visibility, reduced=picture.reduced)
        left, right = (None if hand is None else picture.whole(hand) for hand in hands)
        size = picture.width, picture.height
        return LandmarkArrays(*size, picture.whole(pose.pixels), pose.world_m, left, right), pose
