"""CSV of several Kinect v2 that saw the same persons: one row per camera, person and tracker step.

Columns used, by name: `Tracker_Time` [ms, server], `Person_Id`, `Skeleton_Time` [100 ns, each Kinect's own
clock], `Kinect_Id`, and `<Joint>_X`, `_Y`, `_Z` [m, Kinect axes] of the 25 joints; -9999 = absent. A row is
repeated if a camera had no new frame, and some rows are out of order.

The file has no confidence and no tracking state; a joint that is present gets confidence 1. A take has one
performer: of several persons the one with the most rows is kept, the same in every camera, since persons are
matched between cameras by their number.
"""

from collections import Counter
from datetime import UTC, datetime, timedelta
from pathlib import Path

import numpy as np

from studio.engine.base.errors import FormatError
from studio.engine.model.joints import JOINT_SETS
from studio.take.importers import kinect
from studio.take.importers.recording import Progress, ReadCamera, ReadRecording, put_in_order
from studio.take.importers.table import check_length, csv_rows, first_row, header_index, number, whole_number

ABSENT = -9999.0
_NAMES = JOINT_SETS[kinect.JOINT_SET]
_KEYS = ("Tracker_Time", "Person_Id", "Skeleton_Time", "Kinect_Id")
_COLUMNS = (*_KEYS, *(f"{name}_{axis}" for name in _NAMES for axis in "XYZ"))
_FIRST_YEAR = datetime(1, 1, 1, tzinfo=UTC)

# (Tracker_Time ms, Skeleton_Time ticks, 25 * 3 coordinates)
_Row = tuple[int, int, list[float]]


def matches(path: Path) -> bool:
    """Whether `path` is a text file whose header has at least two of this kind's own columns."""
    return path.is_file() and len({"Kinect_Id", "Skeleton_Time", "Tracker_Time"} & set(first_row(path))) >= 2


def read(path: Path, progress: Progress) -> ReadRecording:
    """Return the recording of one person by every Kinect in the file.

    A camera's time is its own `Skeleton_Time`, shifted so that its first frame lies at its
    `Tracker_Time`, counted from the first in the file.

    Raises:
        FormatError: a damaged file; the message names file, line and column.
    """
    rows = _read_rows(path, progress)
    counts = Counter({person: sum(map(len, by_kinect.values())) for person, by_kinect in rows.items()})
    person, _ = counts.most_common(1)[0]
    notes = []
    if len(counts) > 1:
        others = ", ".join(f"{other} ({count} rows)" for other, count in counts.most_common()[1:])
        notes.append(f"person {person} ({counts[person]} rows) was kept, seen longest; left out: {others}")
    start_ms = min(row[0] for of_kinect in rows[person].values() for row in of_kinect)
    cameras = []
    for k, (kinect_id, of_kinect) in enumerate(rows[person].items()):
        notes.append(f"camera_{k}: Kinect {kinect_id}; the file tells no confidence, a joint present has 1")
        cameras.append(_camera(f"camera_{k}", kinect_id, of_kinect, start_ms, notes))
    return ReadRecording(cameras=tuple(cameras), created=_created(start_ms), notes=notes)


def _read_rows(path: Path, progress: Progress) -> dict[int, dict[str, list[_Row]]]:
    """Return the rows by person and Kinect, both in the order of their first row."""
    rows = csv_rows(path)
    _, header = next(rows, (0, []))
    columns = header_index(path, header)
    missing = [name for name in _COLUMNS if name not in columns]
    if missing:
        raise FormatError(
            "import.columns_missing",
            "{path}: missing columns {names}; give the file as it was recorded",
            path=path,
            names=[*missing],
        )
    coordinates = [columns[name] for name in _COLUMNS[len(_KEYS) :]]
    size, read_bytes = path.stat().st_size, 0
    out: dict[int, dict[str, list[_Row]]] = {}
    for line, cells in rows:
        check_length(path, line, cells, len(header))
        tracker_ms, person, ticks = (
            whole_number(path, line, key, cells[columns[key]])
            for key in ("Tracker_Time", "Person_Id", "Skeleton_Time")
        )
        values = [number(path, line, header[column], cells[column]) for column in coordinates]
        of_kinect = out.setdefault(person, {}).setdefault(cells[columns["Kinect_Id"]], [])
        of_kinect.append((tracker_ms, ticks, values))
        read_bytes += sum(map(len, cells)) + 2 * len(cells)
        if line % 500 == 0:
            progress(min(1.0, read_bytes / size))
    if not out:
        raise FormatError("import.no_rows", "{path} has no rows; a recording needs frames", path=path)
    return out


def _camera(name: str, kinect_id: str, rows: list[_Row], start_ms: int, notes: list[str]) -> ReadCamera:
    tracker_ms, ticks, values = zip(*rows, strict=True)
    first = int(np.argmin(ticks))
    times_ns = (np.array(ticks, dtype=np.int64) - ticks[first]) * kinect.TICK_NS
    times_ns += (tracker_ms[first] - start_ms) * 1_000_000
    order = put_in_order(name, times_ns, notes)
    points = np.array(values).reshape(len(rows), len(_NAMES), 3)[order]
    absent = (points == ABSENT).any(axis=2)
    points[absent] = np.nan
    return ReadCamera(
        name=name,
        device=kinect.DEVICE,
        joint_set=kinect.JOINT_SET,
        serial=kinect_id,
        times_ns=times_ns[order],
        positions=kinect.to_camera(points),
        confidence=np.where(absent, 0.0, 1.0),
    )


def _created(tracker_ms: int) -> str | None:
    """Return the date of a `Tracker_Time`, milliseconds from the year 1; None for another count."""
    try:
        date = _FIRST_YEAR + timedelta(milliseconds=tracker_ms)
    except OverflowError:
        return None
    return date.isoformat(timespec="seconds") if date.year > 2000 else None
