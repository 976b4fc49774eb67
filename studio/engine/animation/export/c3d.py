"""C3D: joint centres and surface markers for biomechanics, millimetres, z up.

The residual of a point is the radius of its 90 % ball in whole millimetres, 0 where unknown, and -1 in a
gap, the format's value for invalid points.
"""

import os
import tempfile
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from studio.engine.animation.clip.options import ExportOptions
from studio.engine.animation.export.points import LabelledPoints, points_of
from studio.engine.animation.read.c3d_worker import load_ezc3d
from studio.engine.animation.read.landmarks import MARKER_ENDING
from studio.engine.base.errors import FormatError
from studio.engine.base.files import write_atomically
from studio.engine.model.poses import Poses
from studio.engine.timecode.timecode import Timecode

_LARGEST_RESIDUAL = 127  # signed byte
_MOST_FRAMES = 65_535
"""Largest count in the header; programs differ in how they read more."""


def write_c3d(poses: Poses, path: str | os.PathLike[str], options: ExportOptions) -> None:
    """Write the poses as a C3D file, atomically; the first frame is frame 1, at time 0.

    Raises:
        FormatError: poses that cannot be exported, or more frames than the format can count.
        NotAvailableError: as `load_ezc3d`.
        StudioError: the file cannot be written.
    """
    _check_count(poses.frame_count)
    first = None if options.timecodes is None else options.timecodes.timecodes_at(poses.time_s[:1])[0]
    write_points_c3d(points_of(poses), poses.frames_per_second, path, first)


def write_points_c3d(
    points: LabelledPoints, rate_hz: float, path: str | os.PathLike[str], first: Timecode | None = None
) -> None:
    """Write points as a C3D file, atomically; the first frame is frame 1, at time 0, with the timecode `first`.

    Raises:
        FormatError: more frames than the format can count.
        NotAvailableError: as `load_ezc3d`.
        StudioError: the file cannot be written.
    """
    _check_count(len(points.positions_m))
    gaps = ~np.isfinite(points.positions_m).all(axis=2)
    radius = np.clip(np.round(np.nan_to_num(points.radius_mm)), 0, _LARGEST_RESIDUAL)
    values = np.ones((4, len(points.labels), len(points.positions_m)))
    values[:3] = points.positions_m.transpose(2, 1, 0) * 1000.0
    file = load_ezc3d().c3d()
    parameters = file["parameters"]["POINT"]
    parameters["RATE"]["value"] = [rate_hz]
    parameters["UNITS"]["value"] = ["mm"]
    parameters["LABELS"]["value"] = list(points.labels)
    parameters["DESCRIPTIONS"]["value"] = [
        "joint centre" if label.islower() and not label.endswith(MARKER_ENDING) else "marker on the skin"
        for label in points.labels
    ]
    file.add_parameter("POINT", "X_SCREEN", ["+X"])
    file.add_parameter("POINT", "Y_SCREEN", ["+Z"])
    if first is not None:
        file.add_parameter("TIMECODE", "START", [str(first)])
        file.add_parameter("TIMECODE", "RATE", [first.rate.name])
        file.add_parameter("TIMECODE", "FRAMES_PER_SECOND", [first.rate.fps])
        file.add_parameter("TIMECODE", "DROP_FRAME", [int(first.rate.drop)])
    file["data"]["points"] = values
    file["data"]["meta_points"]["residuals"] = np.where(gaps, -1.0, 0.0).T[None]
    file["data"]["meta_points"]["camera_masks"] = np.zeros((7, *values.shape[1:]), dtype=bool)
    with write_atomically(path) as target, tempfile.TemporaryDirectory() as folder:
        written = Path(folder) / "points.c3d"
        file.write(str(written))
        target.write(_with_residuals(written.read_bytes(), np.where(gaps, -1.0, radius)))


def _check_count(frames: int) -> None:
    if frames > _MOST_FRAMES:
        raise FormatError(
            "export.c3d_frames",
            "poses: {n} frames; a C3D file holds at most {most}: lower --fps, or export a part",
            n=frames,
            most=_MOST_FRAMES,
        )


def _with_residuals(content: bytes, residuals: NDArray[np.float64]) -> bytes:
    """Return the file with the fourth word of each point set, shape (frame_count, point_count).

    The word's low byte is the residual and its high byte, with the sign, the cameras; ezc3d writes them
    in reverse order. Source: "The C3D File Format User Guide", section on 3D point residuals.
    """
    first_block = int.from_bytes(content[16:18], "little")
    data = np.frombuffer(bytearray(content), "<f4", residuals.size * 4, (first_block - 1) * 512)
    data.reshape(*residuals.shape, 4)[..., 3] = residuals
    return (
        content[: (first_block - 1) * 512] + data.tobytes() + content[(first_block - 1) * 512 + data.nbytes :]
    )
