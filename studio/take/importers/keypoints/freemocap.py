"""FreeMoCap's landmarks: one array of all cameras, found by MediaPipe, whose first 33 points are BlazePose's.

The cameras are in the order of the names of their videos, in `synchronized_videos`. Its calibration is ignored:
the cameras are calibrated again, with its lenses if given (`studio calibrate --lens`).
"""

from pathlib import Path

import numpy as np

from studio.take.importers.keypoints.points import Detections, broken
from studio.take.video.landmarks import LANDMARKS

_PATTERN = "*2[dD]*ata_numCams_numFrames_numTrackedPoints_pixelXY.npy"
_FOLDERS = ("output_data/raw_data", "output_data/*/raw_data", "output_data", ".")
CALIBRATION = "*calibration*.toml"


def array_of(path: Path) -> Path | None:
    """Return the file of the landmarks of a recording; None where there is none."""
    for folder in _FOLDERS:
        for file in sorted(path.glob(f"{folder}/{_PATTERN}")):
            return file
    return None


def read(file: Path) -> list[Detections]:
    """Return the detections of all cameras, in their order.

    Raises:
        FormatError: a damaged file, or an array of another shape.
    """
    try:
        points = np.load(file, allow_pickle=False)
    except (OSError, ValueError, EOFError) as error:
        raise broken(file, error) from error
    if points.ndim != 4 or points.shape[2] < LANDMARKS or points.shape[3] < 2:
        raise broken(
            file, f"an array of shape {points.shape}; it is to be (cameras, frames, 33 or more points, 2)"
        )
    pixels = points[:, :, :LANDMARKS, :2].astype(np.float64)
    sure = np.isfinite(pixels).all(axis=-1, keepdims=True).astype(np.float64)
    people = np.concatenate([pixels, sure], axis=-1)
    return [
        Detections(
            file,
            {number: [one] if one[:, 2].any() else [] for number, one in enumerate(camera)},
            together=True,
        )
        for camera in people
    ]
