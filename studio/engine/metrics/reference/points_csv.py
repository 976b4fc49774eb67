"""Points over time as CSV: joint centres or markers, `time_s` and three columns for each."""

import csv
import os
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from studio.engine.animation.read.landmarks import names_markers
from studio.engine.animation.read.points import NamedPoints, without_subject
from studio.engine.base.errors import FormatError
from studio.engine.base.files import write_atomically
from studio.engine.model.joints import CANONICAL

_AXES = ("x", "y", "z")


def write_points_csv(
    path: str | os.PathLike[str],
    time_s: NDArray[np.float64],
    names: Sequence[str],
    positions_m: NDArray[np.float64],
) -> None:
    """Write points, shape (sample_count, name_count, 3), NaN = unknown, as `read_points_csv` reads them, atomically.

    Raises:
        StudioError: the file cannot be written.
    """
    columns = [f"{name}_{axis}".replace(",", ";").replace('"', "'") for name in names for axis in _AXES]
    lines = [",".join(["time_s", *columns])]
    rows = positions_m.reshape(len(time_s), -1).tolist()
    for at_s, row in zip(time_s.tolist(), rows, strict=True):
        lines.append(",".join([f"{at_s:.6f}", *("" if one != one else f"{one:.6f}" for one in row)]))
    with write_atomically(path) as file:
        file.write(("\n".join(lines) + "\n").encode())


def read_points_csv(path: Path) -> NamedPoints:
    """Return the points in a CSV: `time_s`, then `<name>_x,_y,_z` per point in metres, empty = unknown.

    If any point is a canonical joint, all others are ignored. Otherwise all points are read and must be markers.

    Raises:
        FormatError: a column or value is missing or is not a number; the message names the line.
    """
    with path.open(newline="", encoding="utf-8-sig", errors="replace") as file:
        rows = csv.reader(file)
        header = [name.strip() for name in next(rows, [])]
        columns = _columns(path, header)
        time_column = header.index("time_s")
        times: list[float] = []
        values: list[list[float]] = []
        for row in rows:
            if not row:
                continue
            if len(row) != len(header):
                raise FormatError(
                    "reference.row_length",
                    "{path}, line {line}: {n} values where the header has {count}; is the file cut off?",
                    path=path,
                    line=rows.line_num,
                    n=len(row),
                    count=len(header),
                )
            try:
                times.append(float(row[time_column]))
                values.append([float(row[c]) if row[c].strip() else np.nan for _, _, c in columns])
            except ValueError as error:
                raise FormatError(
                    "table.not_a_number",
                    "{path}, line {line}: {error}; every value must be a number",
                    path=path,
                    line=rows.line_num,
                    error=error,
                ) from error
            if not np.isfinite(times[-1]) or (len(times) > 1 and times[-1] <= times[-2]):
                raise FormatError(
                    "reference.time_order",
                    "{path}, line {line}: time_s must be finite and increase from line to line",
                    path=path,
                    line=rows.line_num,
                )
    if len(times) < 4:
        raise FormatError(
            "reference.few_samples_file",
            "{path}: only {n} samples; a reference needs at least 4",
            path=path,
            n=len(times),
        )
    names = list(dict.fromkeys(name for name, _, _ in columns))
    positions = np.array(values).reshape(len(times), len(names), 3)
    positions[~np.isfinite(positions).all(axis=2)] = np.nan
    kept_names, kept, notes = without_subject(names)
    return NamedPoints(np.array(times), kept_names, positions[:, kept], tuple(notes))


def _columns(path: Path, header: list[str]) -> list[tuple[str, str, int]]:
    """Return name, axis and column of everything that is read, point by point."""
    if "time_s" not in header:
        raise FormatError(
            "reference.no_time_column",
            "{path}, line 1: no column time_s; needed: time_s,<joint>_x,<joint>_y,<joint>_z,...",
            path=path,
        )
    columns = []
    for joint in CANONICAL:
        present = [axis for axis in _AXES if f"{joint}_{axis}" in header]
        missing = [f"{joint}_{axis}" for axis in _AXES if axis not in present]
        if present and missing:
            raise FormatError(
                "reference.missing_column",
                "{path}, line 1: the column {column} is missing; a joint needs _x, _y and _z",
                path=path,
                column=missing[0],
            )
        if present:
            columns += [(joint, axis, header.index(f"{joint}_{axis}")) for axis in _AXES]
    if columns:
        return columns
    names = [one[:-2] for one in header if one.endswith("_x")]
    names = [one for one in names if all(f"{one}_{axis}" in header for axis in _AXES)]
    if not names_markers(without_subject(names)[0]):
        raise FormatError(
            "reference.no_known_joint",
            "{path}, line 1: no joint is known; known joints: {known}",
            path=path,
            known=[*CANONICAL],
        )
    return [(name, axis, header.index(f"{name}_{axis}")) for name in names for axis in _AXES]
