"""CSV and npz: the content of the poses, for users' own programs, on the stage clock and in the stage frame.

The CSV has the form of a reference for `evaluate`: `time_s`, then `<joint>_x`, `_y`, `_z` [m] by canonical joint.
`<joint>_confidence` and `<joint>_uncertainty_mm` follow, then joints without a canonical name under their own. For
one of several performers, a further column `undecided` is 1 where their identity is uncertain; so is the field
`undecided` of the npz, shape (frame_count,). On request, the last column and the field `timecode` have the timecode
of each frame.
"""

import os

import numpy as np
from numpy.typing import NDArray

from studio.engine.animation.clip.kinematics import check_poses
from studio.engine.animation.clip.options import ExportOptions
from studio.engine.animation.export.points import joint_labels
from studio.engine.base.files import write_atomically
from studio.engine.model.poses import Poses

_COLUMNS = ("x", "y", "z", "confidence", "uncertainty_mm")


def write_csv(poses: Poses, path: str | os.PathLike[str], options: ExportOptions) -> None:
    """Write the poses as a CSV file, atomically; an uncertainty that was not measured is empty.

    Raises:
        FormatError: poses that cannot be exported.
        StudioError: the file cannot be written.
    """
    check_poses(poses)
    doubt = undecided(poses, options)
    header = ",".join(["time_s", *(f"{label}_{name}" for label in joint_labels(poses) for name in _COLUMNS)])
    header += "" if doubt is None else ",undecided"
    codes = None if options.timecodes is None else options.timecodes.timecodes_at(poses.time_s)
    header += "" if codes is None else ",timecode"
    values = np.concatenate(
        [poses.positions_m, poses.confidence[..., None], poses.uncertainty_mm[..., None]], axis=2
    ).reshape(poses.frame_count, -1)
    row = ",".join(["%.5f", "%.5f", "%.5f", "%.3f", "%.1f"] * len(poses.joint_names))
    with write_atomically(path) as file:
        file.write(f"{header}\n".encode())
        for frame, (time_s, line) in enumerate(zip(poses.time_s.tolist(), values, strict=True)):
            text = row % tuple(line.tolist())
            last = "" if doubt is None else f",{int(doubt[frame])}"
            last += "" if codes is None else f",{codes[frame]}"
            file.write(f"{time_s:.6f},{text.replace('nan', '')}{last}\n".encode())


def write_npz(poses: Poses, path: str | os.PathLike[str], options: ExportOptions) -> None:
    """Write the poses as a `poses.npz` (see docs/formats.md), atomically.

    Raises:
        FormatError: poses that cannot be exported.
        StudioError: the file cannot be written.
    """
    check_poses(poses)
    timecode = None if options.timecodes is None else options.timecodes.timecodes_at(poses.time_s)
    poses.save(path, undecided=undecided(poses, options), timecode=timecode)


def undecided(poses: Poses, options: ExportOptions) -> NDArray[np.bool_] | None:
    """Return which frames are undecided, shape (frame_count,); None for a single performer."""
    if options.undecided_s is None:
        return None
    inside = np.zeros(poses.frame_count, dtype=bool)
    for begin, end in options.undecided_s:
        inside |= (poses.time_s >= begin) & (poses.time_s <= end)
    return inside
