"""Reader of a table of rigid targets on a body: 17 targets, 60 Hz, recorded together with a depth camera.

Whitespace separates the values. A row is an instant without a time stamp. A target has x, y, z [mm] and a quaternion
x, y, z, w; a quaternion of zeros is a lost target. The order of the targets is that of the readme of the KERAAL
dataset (Nguyen, Devanne et al., "A medical low-back pain physical rehabilitation dataset for human body movement
analysis", IJCNN 2024). Some recordings have a side's forearm and upper arm targets exchanged: the forearm's is
the one nearer to the hand. A target counts for the joint at the far end of its bone.
"""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from studio.engine.base.errors import FormatError

RATE_HZ = 60.0

_JOINTS: tuple[str, ...] = (
    "right_wrist", "left_wrist", "right_elbow", "left_elbow", "chest", "right_knee", "left_knee",
    "right_shoulder", "left_shoulder", "right_hand", "left_hand", "right_toe", "left_toe", "hips", "head",
    "right_ankle", "left_ankle",
)  # fmt: skip
_COLUMNS = 7 * len(_JOINTS)
_EXCHANGED = (("left_wrist", "left_elbow", "left_hand"), ("right_wrist", "right_elbow", "right_hand"))


def read_target_table(
    path: Path,
) -> tuple[NDArray[np.float64], tuple[str, ...], NDArray[np.float64], NDArray[np.float64]]:
    """Return times [s], canonical joints, positions [m] and rotations as `reference.Markers` has them; z is up.

    Raises:
        FormatError: a row has another number of values, a value is no number, or there are too few rows.
    """
    rows: list[list[float]] = []
    with path.open(encoding="utf-8", errors="replace") as file:
        for number, line in enumerate(file, 1):
            words = line.split()
            if not words:
                continue
            if len(words) != _COLUMNS:
                raise FormatError(
                    "reference.target_row",
                    "{path}, line {line}: {n} values; a table of 17 targets has {count} in a row",
                    path=path,
                    line=number,
                    n=len(words),
                    count=_COLUMNS,
                )
            try:
                rows.append([float(word) for word in words])
            except ValueError as error:
                raise FormatError(
                    "table.not_a_number",
                    "{path}, line {line}: {error}; every value must be a number",
                    path=path,
                    line=number,
                    error=error,
                ) from error
    if len(rows) < 4:
        raise FormatError(
            "reference.few_samples_file",
            "{path}: only {n} samples; a reference needs at least 4",
            path=path,
            n=len(rows),
        )
    values = np.array(rows).reshape(len(rows), len(_JOINTS), 7)
    lost = ~np.isfinite(values).all(axis=2) | (np.linalg.norm(values[..., 3:], axis=2) < 0.5)
    positions = np.where(lost[..., None], np.nan, values[..., :3] * 1e-3)
    quaternions = np.where(lost[..., None], [0.0, 0.0, 0.0, 1.0], values[..., 3:])
    rotations = Rotation.from_quat(quaternions.reshape(-1, 4)).as_matrix().reshape(*lost.shape, 3, 3)
    order = list(range(len(_JOINTS)))
    for wrist, elbow, hand in (tuple(_JOINTS.index(name) for name in limb) for limb in _EXCHANGED):
        far, near = (
            np.nanmedian(np.linalg.norm(positions[:, joint] - positions[:, hand], axis=1))
            for joint in (wrist, elbow)
        )
        if far > near:
            order[wrist], order[elbow] = elbow, wrist
    return np.arange(len(rows)) / RATE_HZ, _JOINTS, positions[:, order], rotations[:, order]
