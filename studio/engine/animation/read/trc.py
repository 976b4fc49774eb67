"""Reader of TRC files: marker positions as text, y up, as written by OpenSim and motion capture programs."""

import os
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from studio.engine.animation.read.points import NamedPoints, without_subject
from studio.engine.base.errors import FormatError
from studio.engine.base.file_sentences import too_large
from studio.engine.base.sentences import system_says

_MAX_BYTES = 1 << 30
_MAX_POINTS = 4096
_ROUNDING_S = 0.6e-3
_UNITS_M = {"mm": 0.001, "cm": 0.01, "m": 1.0, "meters": 1.0, "millimeters": 0.001, "centimeters": 0.01}


def read_trc(path: str | os.PathLike[str]) -> NamedPoints:
    """Return the points in a TRC file; the first frame is at time 0.

    Raises:
        FormatError: the file is missing, not a TRC, truncated, or a value is not a number; names the line.
    """
    path = Path(path)
    lines = _lines(path)
    if len(lines) < 5 or not lines[0].startswith("PathFileType"):
        raise FormatError(
            "trc.not_trc",
            "{path} is not a TRC file: it does not begin with PathFileType; give a TRC file",
            path=path,
        )
    header = {k.strip(): v.strip() for k, v in zip(lines[1].split("\t"), lines[2].split("\t"), strict=False)}
    try:
        count, frames = int(header["NumMarkers"]), int(header["NumFrames"])
        unit_m = _UNITS_M[header["Units"].lower()]
    except (KeyError, ValueError) as error:
        raise FormatError(
            "trc.header",
            "{path}, line 3: needs NumFrames, NumMarkers (whole numbers) and Units (mm, cm or "
            "m); {error} is missing or not one",
            path=path,
            error=error,
        ) from error
    if not 0 < count <= _MAX_POINTS or frames <= 0:
        raise FormatError(
            "trc.size",
            "{path}, line 3: {n} markers in {frames} frames; allowed are 1 to {most}",
            path=path,
            n=count,
            frames=frames,
            most=_MAX_POINTS,
        )
    labels = lines[3].rstrip("\t\n").split("\t")[2::3]
    if len(labels) != count:
        raise FormatError(
            "trc.labels",
            "{path}, line 4: {n} labels of {count} markers; export the file again",
            path=path,
            n=len(labels),
            count=count,
        )
    rows = [(n, line) for n, line in enumerate(lines[5:], 6) if line.strip()]
    if len(rows) < frames:
        raise FormatError(
            "trc.cut_off",
            "{path} is cut off: {n} of {all} frames; export or copy it again",
            path=path,
            n=len(rows),
            all=frames,
        )
    values = np.full((frames, 1 + 3 * count), np.nan)
    for row, (number, line) in enumerate(rows[:frames]):
        values[row] = _row(path, number, line, count)
    names, kept, notes = without_subject(labels)
    positions = values[:, 1:].reshape(frames, count, 3)[:, kept] * unit_m
    positions[~np.isfinite(positions).all(axis=2)] = np.nan
    if (np.diff(values[:, 0]) <= 0).any() or not np.isfinite(values[:, 0]).all():
        raise FormatError(
            "trc.times",
            "{path}: the column Time must hold numbers that increase; export the file again",
            path=path,
        )
    return NamedPoints(
        time_s=_on_grid(values[:, 0] - values[0, 0], header.get("DataRate", "")),
        names=names,
        positions_m=positions[..., [0, 2, 1]] * [1.0, -1.0, 1.0],  # y up to z up
        notes=tuple(notes),
    )


def _on_grid(time_s: NDArray[np.float64], rate: str) -> NDArray[np.float64]:
    """Return times without their rounding error, if they fit the file's own rate."""
    try:
        grid = np.arange(len(time_s)) / float(rate)
    except (ValueError, ZeroDivisionError):
        return time_s
    return grid if np.abs(grid - time_s).max() < _ROUNDING_S else time_s


def _lines(path: Path) -> list[str]:
    try:
        if path.stat().st_size > _MAX_BYTES:
            raise FormatError(too_large(path, _MAX_BYTES))
        return path.read_text(encoding="utf-8", errors="replace").lstrip("\ufeff").splitlines()
    except OSError as error:
        raise FormatError(
            "file.unreadable_trc",
            "cannot read {path}: {error}; give a TRC file",
            path=path,
            error=system_says(error),
        ) from error


def _row(path: Path, number: int, line: str, count: int) -> list[float]:
    """Return the time and the coordinates of a frame, NaN where a cell is empty or missing at the line's end."""
    cells = line.rstrip("\n").split("\t")[1:]
    cells = cells[: 1 + 3 * count] + [""] * (1 + 3 * count - len(cells))
    try:
        return [float(cell) if cell.strip() else np.nan for cell in cells]
    except ValueError as error:
        raise FormatError(
            "table.not_a_number",
            "{path}, line {line}: {error}; every value must be a number",
            path=path,
            line=number,
            error=error,
        ) from error
