"""Reader of C3D files: labelled points, markers or joint centres, by ezc3d in a separate process."""

import os
from pathlib import Path

import numpy as np

from studio.engine.animation.read.apart import read_apart
from studio.engine.animation.read.points import NamedPoints, without_subject
from studio.engine.base.errors import FormatError

_UNITS_M = {"mm": 0.001, "cm": 0.01, "m": 1.0, "dm": 0.1, "in": 0.0254, "": 0.001}


def read_c3d(path: str | os.PathLike[str]) -> NamedPoints:
    """Return the points in a C3D file; the first frame is at time 0.

    POINT:Y_SCREEN names the axis that is up, z if missing; POINT:UNITS is the unit.

    Raises:
        FormatError: the file is missing, not a C3D, truncated, or has no points.
        NotAvailableError: as `load_ezc3d`.
    """
    path = Path(path)
    data = read_apart("c3d_worker", path)
    unit, rate = str(data["unit"]).strip().lower(), float(data["rate"])
    if unit not in _UNITS_M:
        raise FormatError(
            "c3d.unit",
            "{path}: unknown unit {unit!r}; allowed are {allowed}",
            path=path,
            unit=unit,
            allowed=[*filter(None, _UNITS_M)],
        )
    if not 0.0 < rate <= 100_000.0:
        raise FormatError(
            "c3d.rate",
            "{path}: a rate of {rate:g} Hz; give a file whose POINT:RATE is a positive number",
            path=path,
            rate=rate,
        )
    names, kept, notes = without_subject([str(label) for label in data["labels"]])
    positions = data["positions"][:, kept].astype(np.float64) * _UNITS_M[unit]
    if str(data["up"]).strip().upper() in ("+Y", "Y"):
        positions = positions[..., [0, 2, 1]] * [1.0, -1.0, 1.0]
    return NamedPoints(np.arange(len(positions)) / rate, names, positions, tuple(notes))
