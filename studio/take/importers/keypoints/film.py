"""Times and sizes of the pictures in which another program found landmarks."""

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from studio.engine.base.errors import FormatError
from studio.take.importers.videos import camera_name
from studio.take.video.file import VideoFile, is_video

PLACES = ("videos", "synchronized_videos", ".")
"""Folders below a project's that may hold its videos."""

_MOST_FRAMES = 10_000_000


@dataclass(frozen=True)
class Film:
    """The pictures of a camera.

    Attributes:
        times_ns: since its beginning [ns], shape (picture_count,).
        width, height: [pixels].
        video: its file; None = there is none.
    """

    times_ns: NDArray[np.int64]
    width: int
    height: int
    video: Path | None = None


def videos_beside(path: Path) -> dict[str, Path]:
    """Return the videos of a project by the names of their cameras."""
    found: dict[str, Path] = {}
    for place in PLACES:
        for file in sorted((path / place).glob("*.*")):
            if camera_name(file) not in found and is_video(file):
                found[camera_name(file)] = file
    return found


def film_of(path: Path, name: str, video: Path | None, count: int, size: tuple[int, int] | None) -> Film:
    """Return times and picture size of a camera: from its video, else from `recording.json`.

    Args:
        path: folder of the project.
        name: of the camera.
        video: its file, if there is one.
        count: number of pictures that are needed.
        size: of the pictures [pixels], if another file gives it.

    Raises:
        FormatError: they are unknown.
    """
    if video is not None:
        opened = VideoFile.open(video)
        return Film(opened.times_ns(), *opened.size(), video)
    try:
        said: Any = json.loads((path / "recording.json").read_text(encoding="utf-8"))
        width, height = size or (int(one) for one in said["image_size"])
        rate = float(said["frames_per_second"])
        if not (
            16 <= width <= 16384 and 16 <= height <= 16384 and 1 <= rate <= 1000 and count <= _MOST_FRAMES
        ):
            raise ValueError("a number is out of range")
    except (OSError, ValueError, TypeError, KeyError, OverflowError, RecursionError) as error:
        raise FormatError(
            "import.keypoints_no_video",
            "{path}: the landmarks of {name} have no times and no picture size ({error}): put its video into "
            'videos/, or write recording.json with {{"frames_per_second": 60, "image_size": [1920, 1080]}}',
            path=path,
            name=name,
            error=str(error) or type(error).__name__,
        ) from error
    return Film(np.round(np.arange(count) * 1e9 / rate).astype(np.int64), width, height)
