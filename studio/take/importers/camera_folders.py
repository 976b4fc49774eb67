"""Folders of `camera_K/`, each with `joints.csv`, or `depth.txt` and `camera.json`, or both.

`calibration.json` and `recording.json` next to them are optional.
"""

import json
import math
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

from studio.engine.base.errors import CalibrationError, FormatError
from studio.engine.model.calibration import Calibration
from studio.take.folder.take import read_calibration
from studio.take.importers import depth_folder, joints_csv
from studio.take.importers.recording import Progress, ReadCamera, ReadRecording
from studio.wire import is_camera_name

_FILES = ("joints.csv", "depth.txt")


def matches(path: Path) -> bool:
    """Whether `path` is a folder with a `camera_K/joints.csv` or `camera_K/depth.txt`."""
    return path.is_dir() and any(file for name in _FILES for file in path.glob(f"camera_*/{name}"))


def read(path: Path, progress: Progress) -> ReadRecording:
    """Return the recording in a folder; depth images are read when the recording is written.

    Raises:
        FormatError: a damaged file; the message names file, line and column.
    """
    folders = sorted((f for f in path.glob("camera_*") if f.is_dir()), key=_natural)
    empty = [f.name for f in folders if not any((f / name).is_file() for name in _FILES)]
    if empty:
        raise FormatError(
            "import.camera_folder_empty",
            "{path}: {names} has neither joints.csv nor depth.txt; add one, or remove the folder",
            path=path,
            names=[*empty],
        )
    notes: list[str] = []
    cameras = []
    for k, folder in enumerate(folders):
        cameras.append(_read_camera(folder, notes))
        progress((k + 1) / len(folders))
    return read_beside(path, tuple(cameras), notes)


def read_beside(
    path: Path, cameras: tuple[ReadCamera, ...], notes: list[str], *, created: str | None = None
) -> ReadRecording:
    """Return the recording with the content of `calibration.json` and `recording.json` in a folder.

    Raises:
        FormatError: one of them is damaged.
    """
    return ReadRecording(
        cameras=cameras,
        calibration=_calibration(path / "calibration.json", [camera.name for camera in cameras], notes),
        calibration_s=_calibration_s(path / "recording.json"),
        created=created,
        notes=notes,
    )


def _read_camera(folder: Path, notes: list[str]) -> ReadCamera:
    if not is_camera_name(folder.name):
        raise FormatError(
            "import.camera_folder_name",
            "{path}: {name!r} cannot name a camera; allowed: letters, digits, _ . and -",
            path=folder,
            name=folder.name,
        )
    depth = depth_folder.read_depth(folder, notes) if (folder / "depth.txt").is_file() else None
    if not (folder / "joints.csv").is_file():
        assert depth is not None
        return ReadCamera.of_depth(folder.name, depth)
    return replace(joints_csv.read_camera(folder / "joints.csv", folder.name, notes), depth=depth)


def _natural(folder: Path) -> list[int | str]:
    return [int(part) if part.isdigit() else part for part in re.split(r"(\d+)", folder.name, flags=re.ASCII)]


def _calibration(file: Path, names: list[str], notes: list[str]) -> Calibration | None:
    if not file.is_file():
        return None
    try:
        calibration = read_calibration(file)
    except CalibrationError as error:
        raise FormatError(
            "import.calibration_broken",
            "{path}: mend the file, or remove it and calibrate: {error}",
            path=file,
            error=error,
        ) from error
    missing = [name for name in names if name not in calibration.cameras]
    if len(missing) == len(names):
        raise FormatError(
            "import.camera_names_differ",
            "{path} has the cameras {names}, the recording {others}; use the recording's names, "
            "or remove the file and calibrate",
            path=file,
            names=[*calibration.cameras],
            others=[*names],
        )
    if missing:
        notes.append(f"calibration.json lacks {', '.join(missing)}: not used until the take is calibrated")
    return calibration


def _calibration_s(file: Path) -> float | None:
    """Return the length of the calibration part [s] from `recording.json`, None if it has none."""
    if not file.is_file():
        return None
    try:
        value: Any = json.loads(file.read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError) as error:
        raise FormatError(
            "import.not_json", "{path} is not JSON ({error}); mend or remove it", path=file, error=error
        ) from error
    seconds = value.get("calibration_s") if isinstance(value, dict) else math.nan
    if seconds is None:
        return None
    if isinstance(seconds, bool) or not isinstance(seconds, int | float) or not 0 <= seconds < 1e9:
        raise FormatError(
            "import.calibration_seconds",
            "{path}: calibration_s is not a number of seconds; give one, or remove the file",
            path=file,
        )
    return float(seconds)
