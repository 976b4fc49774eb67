"""Check whether a file from elsewhere is a video; runs in a separate process."""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from studio.take.video.file import VideoFile, no_frame


def frame_times_ns(path: Path) -> NDArray[np.int64]:
    """Return the times of a video's frames [ns], shape (frame_count,), once its first frame was decoded.

    Raises:
        FormatError: it is no video, or no frame of it can be read.
    """
    video = VideoFile.open(path)
    if next(video.frames(), None) is None:
        raise no_frame(path)
    return video.times_ns()
