"""Folders of `camera_K/joints.csv`, with an optional `calibration.json` and `recording.json`.

A row is `time_s`, then `<joint>_x,_y,_z,_confidence` of canonical joints in the camera frame [m]; empty =
unseen. Columns are found by name, in any order; a camera does not know the joints that its header leaves out.
"""

import json
import math
import re
from pathlib import Path
from typing import Any

import numpy as np

from studio.engine.calibration.result import Calibration
from studio.engine.errors import CalibrationError, FormatError, NotAvailableError
from studio.engine.joints import CANONICAL, INDEX, JOINT_COUNT
from studio.take.importers.recording import Progress, ReadCamera, ReadRecording, put_in_order, seconds_to_ns
from studio.take.importers.table import check_length, csv_rows, header_index, number
from studio.take.take import read_calibration
from studio.wire import is_camera_name

_PARTS = ("x", "y", "z", "confidence")


def matches(path: Path) -> bool:
    """Whether `path` is a folder with a `camera_K/joints.csv`."""
    return path.is_dir() and any(path.glob("camera_*/joints.csv"))


def read(path: Path, progress: Progress) -> ReadRecording:
    """Return the recording in a folder.

    Raises:
        FormatError: a broken file; the message names file, line and column.
        NotAvailableError: a camera that has only depth.
    """
    folders = sorted((f for f in path.glob("camera_*") if f.is_dir()), key=_natural)
    depth_only = [f.name for f in folders if not (f / "joints.csv").is_file()]
    if depth_only:
        raise NotAvailableError(
            f"{path}: {', '.join(depth_only)} has no joints.csv; depth is not available in this version"
        )
    notes: list[str] = []
    cameras = []
    for k, folder in enumerate(folders):
        cameras.append(read_camera(folder / "joints.csv", folder.name, notes))
        progress((k + 1) / len(folders))
    return ReadRecording(
        cameras=tuple(cameras),
        calibration=_calibration(path / "calibration.json", [camera.name for camera in cameras], notes),
        calibration_s=_calibration_s(path / "recording.json"),
        notes=notes,
    )


def read_camera(file: Path, name: str, notes: list[str]) -> ReadCamera:
    """Return one camera's frames.

    Raises:
        FormatError: a broken file.
    """
    if not is_camera_name(name):
        raise FormatError(
            f"{file.parent}: {name!r} cannot name a camera; allowed: letters, digits, _ . and -"
        )
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
            raise FormatError(f"{file}:{line}: time_s is {seconds:g}; at most 4.6e9 s is allowed")
        times_ns.append(time_ns)
        values.append(_row(file, line, cells, header, joint_columns))
    if not times_ns:
        raise FormatError(f"{file} has no rows; a recording needs frames")
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


def _natural(folder: Path) -> list[int | str]:
    return [int(part) if part.isdigit() else part for part in re.split(r"(\d+)", folder.name, flags=re.ASCII)]


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
            f"{file}: missing columns {', '.join(missing)}; needed: time_s, and "
            "<joint>_x, _y, _z, _confidence of every joint that is named"
        )
    unknown = sorted(
        {c.rpartition("_")[0] for c in header if c.rpartition("_")[2] in _PARTS} - set(CANONICAL)
    )
    if unknown or not joints:
        raise FormatError(
            f"{file}: {'unknown joints ' + ', '.join(unknown) if unknown else 'no joint is named'}; "
            f"allowed: {', '.join(CANONICAL)}"
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
            raise FormatError(f"{file}:{line}: {header[columns[3]]} is {out[-1]:g}; allowed: 0 to 1")
    return out


def _calibration(file: Path, names: list[str], notes: list[str]) -> Calibration | None:
    if not file.is_file():
        return None
    try:
        calibration = read_calibration(file)
    except CalibrationError as error:
        raise FormatError(f"{file}: mend the file, or remove it and calibrate: {error}") from error
    missing = [name for name in names if name not in calibration.cameras]
    if len(missing) == len(names):
        raise FormatError(
            f"{file} has the cameras {', '.join(calibration.cameras)}, the recording {', '.join(names)}; "
            "use the recording's names, or remove the file and calibrate"
        )
    if missing:
        notes.append(f"calibration.json lacks {', '.join(missing)}: not used until the take is calibrated")
    return calibration


def _calibration_s(file: Path) -> float | None:
    """Return the length of the calibration part [s] from `recording.json`, None where it is not told."""
    if not file.is_file():
        return None
    try:
        value: Any = json.loads(file.read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError) as error:
        raise FormatError(f"{file} is not JSON ({error}); mend or remove it") from error
    seconds = value.get("calibration_s") if isinstance(value, dict) else math.nan
    if seconds is None:
        return None
    if isinstance(seconds, bool) or not isinstance(seconds, int | float) or not 0 <= seconds < 1e9:
        raise FormatError(f"{file}: calibration_s is not a number of seconds; give one, or remove the file")
    return float(seconds)
