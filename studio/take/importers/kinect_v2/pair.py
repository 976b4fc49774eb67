"""CSV of several Kinect v2 that saw the same persons: one row per camera, person and tracker step.

Columns used, by name: `Tracker_Time` [ms, server], `Person_Id`, `Skeleton_Time` [100 ns, each Kinect's own
clock], `Kinect_Id`, and `<Joint>_X`, `_Y`, `_Z` [m, Kinect axes] of the 25 joints; -9999 = absent. A row is
repeated if a camera had no new frame, and some rows are out of order.

The file has no confidence and no tracking state; a joint that is present gets confidence 1. Persons are matched
between cameras by their number. One person's skeletons are kept unchanged; several persons are brought into one
frame by `kinect_people`, and the take is given the cameras' calibration.
"""

from datetime import UTC, datetime, timedelta
from pathlib import Path

import numpy as np

from studio.engine.base.errors import FormatError
from studio.engine.model.joints import JOINT_SETS
from studio.take.importers.kinect_v2 import joint_set
from studio.take.importers.kinect_v2.people import (
    PersonStream,
    PersonStreams,
    calibrated_by_all,
    in_one_frame,
)
from studio.take.importers.recording import OtherBody, Progress, ReadCamera, ReadRecording, put_in_order
from studio.take.importers.table import check_length, csv_rows, first_row, header_index, number, whole_number

ABSENT = -9999.0
_NAMES = JOINT_SETS[joint_set.JOINT_SET]
_KEYS = ("Tracker_Time", "Person_Id", "Skeleton_Time", "Kinect_Id")
_COLUMNS = (*_KEYS, *(f"{name}_{axis}" for name in _NAMES for axis in "XYZ"))
_FIRST_YEAR = datetime(1, 1, 1, tzinfo=UTC)

# (Tracker_Time ms, Skeleton_Time ticks, 25 * 3 coordinates)
_Row = tuple[int, int, list[float]]


def matches(path: Path) -> bool:
    """Whether `path` is a text file whose header has at least two of this kind's own columns."""
    return path.is_file() and len({"Kinect_Id", "Skeleton_Time", "Tracker_Time"} & set(first_row(path))) >= 2


def read(path: Path, progress: Progress) -> ReadRecording:
    """Return the recording of every person by every Kinect in the file.

    A camera's time is its own `Skeleton_Time`, shifted so that its first frame lies at its
    `Tracker_Time`, counted from the first in the file.

    Raises:
        FormatError: a damaged file; the message names file, line and column.
    """
    rows = _read_rows(path, progress)
    start_ms = min(row[0] for by_kinect in rows.values() for mine in by_kinect.values() for row in mine)
    kinects = [*dict.fromkeys(kinect_id for by_kinect in rows.values() for kinect_id in by_kinect)]
    names = {kinect_id: f"camera_{k}" for k, kinect_id in enumerate(kinects)}
    notes: list[str] = []
    streams: PersonStreams = {}
    for kinect_id, name in names.items():
        notes.append(f"{name}: Kinect {kinect_id}; the file tells no confidence, a joint present has 1")
        of_kinect = {who: mine[kinect_id] for who, mine in rows.items() if kinect_id in mine}
        streams[name] = _streams(name, of_kinect, start_ms, notes)
    calibration = None
    if len(rows) > 1:
        streams = in_one_frame(streams, {who: names[next(iter(mine))] for who, mine in rows.items()}, notes)
        calibration = calibrated_by_all(streams, notes)
    serials = {name: kinect_id for kinect_id, name in names.items()}
    return ReadRecording(
        cameras=tuple(_camera(name, serials[name], people) for name, people in streams.items()),
        calibration=calibration,
        created=_created(start_ms),
        notes=notes,
    )


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


def _streams(
    name: str, people: dict[int, list[_Row]], start_ms: int, notes: list[str]
) -> dict[int, PersonStream]:
    """Return one Kinect's skeletons by person, all on its clock."""
    tracker_ms, first = min((row[:2] for rows in people.values() for row in rows), key=lambda row: row[1])
    out: dict[int, PersonStream] = {}
    for person, rows in people.items():
        _, ticks, values = zip(*rows, strict=True)
        times_ns = (np.array(ticks, dtype=np.int64) - first) * joint_set.TICK_NS
        times_ns += (tracker_ms - start_ms) * 1_000_000
        whose = name if len(people) == 1 else f"{name}, person {person}"
        order = put_in_order(whose, times_ns, notes)
        points = np.array(values).reshape(len(rows), len(_NAMES), 3)[order]
        absent = (points == ABSENT).any(axis=2)
        points[absent] = np.nan
        out[person] = PersonStream(times_ns[order], joint_set.to_camera(points), np.where(absent, 0.0, 1.0))
    return out


def _camera(name: str, kinect_id: str, people: dict[int, PersonStream]) -> ReadCamera:
    """Return a Kinect with everybody in its frames, by their numbers."""
    bodies: dict[int, list[OtherBody]] = {}
    for person, stream in people.items():
        for k, time_ns in enumerate(stream.times_ns.tolist()):
            one = OtherBody(person, stream.positions[k], stream.confidence[k])
            bodies.setdefault(time_ns, []).append(one)
    in_order = [mine for _, mine in sorted(bodies.items())]
    return ReadCamera(
        name=name,
        device=joint_set.DEVICE,
        joint_set=joint_set.JOINT_SET,
        serial=kinect_id,
        times_ns=np.array(sorted(bodies), dtype=np.int64),
        positions=np.array([mine[0].positions for mine in in_order]),
        confidence=np.array([mine[0].confidence for mine in in_order]),
        body=np.array([mine[0].number for mine in in_order], dtype=np.int64),
        others=[mine[1:] for mine in in_order],
    )


def _created(tracker_ms: int) -> str | None:
    """Return the date of a `Tracker_Time`, milliseconds from the year 1; None for another count."""
    try:
        date = _FIRST_YEAR + timedelta(milliseconds=tracker_ms)
    except OverflowError:
        return None
    return date.isoformat(timespec="seconds") if date.year > 2000 else None
