"""CSV and npz: the content of the poses, for users' own programs, on the stage clock and in the stage frame.

The CSV has the form of a reference for `evaluate`: `time_s`, then `<joint>_x`, `_y`, `_z` [m] by canonical joint.
`<joint>_confidence` and `<joint>_uncertainty_mm` follow, then joints without a canonical name under their own.
"""

import os

import numpy as np

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
    header = ",".join(["time_s", *(f"{label}_{name}" for label in joint_labels(poses) for name in _COLUMNS)])
    values = np.concatenate(
        [poses.positions_m, poses.confidence[..., None], poses.uncertainty_mm[..., None]], axis=2
    ).reshape(poses.frame_count, -1)
    row = ",".join(["%.5f", "%.5f", "%.5f", "%.3f", "%.1f"] * len(poses.joint_names))
    with write_atomically(path) as file:
        file.write(f"{header}\n".encode())
        for time_s, line in zip(poses.time_s.tolist(), values, strict=True):
            text = row % tuple(line.tolist())
            file.write(f"{time_s:.6f},{text}\n".replace("nan", "").encode())


def write_npz(poses: Poses, path: str | os.PathLike[str], options: ExportOptions) -> None:
    """Write the poses as a `poses.npz` (see docs/formats.md), atomically.

    Raises:
        FormatError: poses that cannot be exported.
        StudioError: the file cannot be written.
    """
    check_poses(poses)
    poses.save(path)
