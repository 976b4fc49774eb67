"""`joints.csv`: one camera's skeletons.

A row is `time_s`, then `<joint>_x,_y,_z,_confidence` of canonical joints in the camera frame [m]; empty =
unseen. Columns are found by name, in any order; a camera lacks the joints that are not in its header.
"""

import math
from pathlib import Path

import numpy as np

from studio.engine.base.errors import FormatError
from studio.engine.model.joints import CANONICAL, INDEX, JOINT_COUNT
from studio.take.importers.recording import ReadCamera, put_in_order, seconds_to_ns
from studio.take.importers.table import check_length, csv_rows, header_index, number

_PARTS = ("x", "y", "z", "confidence")


def read_camera(file: Path, name: str, notes: list[str]) -> ReadCamera:
    """Return one camera's frames.

    Raises:
        FormatError: a broken file.
    """
    rows = csv_rows(file)
    _, header = next(rows, (0, []))
    time_column, joint_columns = _columns(file, header)
    times_ns: list[int] = []
    values: list[list[float]] = []
    for line, cells in rows:
        check_length(file, line, cells, len(header))
        seconds = number(file, line, "time_s", cells[time_column])
        time_ns = seconds_to_ns(seconds)
        if time_ns is None:
            raise FormatError(
                "import.time_too_large",
                "{path}:{line}: time_s is {value:g}; at most 4.6e9 s is allowed",
                path=file,
                line=line,
                value=seconds,
            )
        times_ns.append(time_ns)
        values.append(_row(file, line, cells, header, joint_columns))
    if not times_ns:
        raise FormatError("import.no_rows", "{path} has no rows; a recording needs frames", path=file)
    times = np.array(times_ns, dtype=np.int64)
    order = put_in_order(name, times, notes)
    joints = np.full((len(times), JOINT_COUNT, 4), np.nan)
    joints[:, list(joint_columns)] = np.array(values).reshape(len(times), len(joint_columns), 4)
    joints[np.isnan(joints).any(axis=2)] = [np.nan, np.nan, np.nan, 0.0]
    return ReadCamera(
        name=name,
        device="joints.csv",
        joint_set="canonical",
        times_ns=times[order],
        positions=joints[order, :, :3],
        confidence=joints[order, :, 3],
    )


def _columns(file: Path, header: list[str]) -> tuple[int, dict[int, list[int]]]:
    """Return the column of the time, and by canonical joint index the columns of x, y, z, confidence."""
    columns = header_index(file, header)
    missing = [] if "time_s" in columns else ["time_s"]
    joints: dict[int, list[int]] = {}
    for name in CANONICAL:
        wanted = [f"{name}_{part}" for part in _PARTS]
        if any(column in columns for column in wanted):
            missing += [column for column in wanted if column not in columns]
            joints[INDEX[name]] = [columns.get(column, -1) for column in wanted]
    if missing:
        raise FormatError(
            "import.joint_columns_missing",
            "{path}: missing columns {names}; needed: time_s, and <joint>_x, _y, _z, _confidence "
            "of every joint that is named",
            path=file,
            names=[*missing],
        )
    unknown = sorted(
        {c.rpartition("_")[0] for c in header if c.rpartition("_")[2] in _PARTS} - set(CANONICAL)
    )
    if unknown:
        raise FormatError(
            "import.unknown_joints",
            "{path}: unknown joints {names}; allowed: {allowed}",
            path=file,
            names=unknown,
            allowed=[*CANONICAL],
        )
    if not joints:
        raise FormatError(
            "import.no_joint",
            "{path}: no joint is named; allowed: {allowed}",
            path=file,
            allowed=[*CANONICAL],
        )
    return columns["time_s"], joints


def _row(
    file: Path, line: int, cells: list[str], header: list[str], joints: dict[int, list[int]]
) -> list[float]:
    """Return x, y, z, confidence of every joint, NaN where a cell is empty."""
    out = []
    for columns in joints.values():
        for column in columns:
            text = cells[column]
            out.append(number(file, line, header[column], text) if text else math.nan)
        if out[-1] < 0 or out[-1] > 1:
            raise FormatError(
                "import.confidence",
                "{path}:{line}: {column} is {value:g}; allowed: 0 to 1",
                path=file,
                line=line,
                column=header[columns[3]],
                value=out[-1],
            )
    return out
