"""`joints.csv`: one camera's skeletons.

A row is `time_s`, then `<joint>_x,_y,_z,_confidence` of canonical joints in the camera frame [m]; empty =
unseen. Columns are found by name, in any order; a camera lacks the joints that are not in its header. A column `body`
holds the device's own number of a body; rows of one time are then the bodies of one frame.
"""

import math
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from studio.engine.base.errors import FormatError
from studio.engine.model.joints import CANONICAL, INDEX, JOINT_COUNT
from studio.take.importers.recording import OtherBody, ReadCamera, put_in_order, seconds_to_ns
from studio.take.importers.table import check_length, csv_rows, header_index, number
from studio.wire import MOST_OTHERS

_PARTS = ("x", "y", "z", "confidence")


def read_camera(file: Path, name: str, notes: list[str]) -> ReadCamera:
    """Return one camera's frames.

    Raises:
        FormatError: a broken file.
    """
    rows = csv_rows(file)
    _, header = next(rows, (0, []))
    time_column, joint_columns = _columns(file, header)
    body_column = header.index("body") if "body" in header else None
    times_ns: list[int] = []
    bodies: list[int] = []
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
        if body_column is not None:
            bodies.append(_body(file, line, cells[body_column]))
        values.append(_row(file, line, cells, header, joint_columns))
    if not times_ns:
        raise FormatError("import.no_rows", "{path} has no rows; a recording needs frames", path=file)
    times = np.array(times_ns, dtype=np.int64)
    joints = np.full((len(times), JOINT_COUNT, 4), np.nan)
    joints[:, list(joint_columns)] = np.array(values).reshape(len(times), len(joint_columns), 4)
    joints[np.isnan(joints).any(axis=2)] = [np.nan, np.nan, np.nan, 0.0]
    first, others = np.arange(len(times)), None
    if body_column is not None:
        first, others = _frames(name, times, np.array(bodies), joints, notes)
    order = first[put_in_order(name, times[first], notes)]
    return ReadCamera(
        name=name,
        device="joints.csv",
        joint_set="canonical",
        times_ns=times[order],
        positions=joints[order, :, :3],
        confidence=joints[order, :, 3],
        body=np.array(bodies)[order] if body_column is not None else None,
        others=None if others is None else [others.get(int(times[row]), []) for row in order],
    )


def _body(file: Path, line: int, text: str) -> int:
    value = number(file, line, "body", text)
    if value != int(value) or not 0 <= value < 2**31:
        raise FormatError(
            "import.body_number",
            "{path}:{line}: body is {value:g}; allowed: whole numbers from 0 to 2147483647",
            path=file,
            line=line,
            value=value,
        )
    return int(value)


def _frames(
    name: str,
    times: NDArray[np.int64],
    bodies: NDArray[np.int64],
    joints: NDArray[np.float64],
    notes: list[str],
) -> tuple[NDArray[np.int64], dict[int, list[OtherBody]]]:
    """Return the row of each frame's first body (the lowest number), and the other bodies by time [ns]."""
    found: dict[int, dict[int, int]] = {}
    repeated = 0
    for row, (time_ns, body) in enumerate(zip(times.tolist(), bodies.tolist(), strict=True)):
        rows = found.setdefault(time_ns, {})
        repeated += body in rows
        rows.setdefault(body, row)
    if repeated:
        notes.append(f"{name}: {repeated} rows repeat a body and a time and were left out")
    crowded = sum(len(rows) > 1 + MOST_OTHERS for rows in found.values())
    if crowded:
        notes.append(f"{name}: {crowded} frames have over {1 + MOST_OTHERS} bodies; the rest was left out")
    first, others = [], {}
    for time_ns, rows in found.items():
        one, *rest = [rows[body] for body in sorted(rows)][: 1 + MOST_OTHERS]
        first.append(one)
        others[time_ns] = [OtherBody(int(bodies[row]), joints[row, :, :3], joints[row, :, 3]) for row in rest]
    return np.array(first, dtype=np.int64), others


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
