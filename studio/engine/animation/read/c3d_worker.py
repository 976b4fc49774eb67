"""Worker of `apart` that reads a C3D with ezc3d: labels, unit, rate, the axis that is up, positions (F, N, 3)."""

from pathlib import Path
from typing import Any

import numpy as np

from studio.engine.animation.read.apart import work
from studio.engine.base.errors import FormatError, NotAvailableError


def load_ezc3d() -> Any:
    """Return the module ezc3d.

    Raises:
        NotAvailableError: it is not installed, as on Linux on ARM, for which it has no wheel.
    """
    try:
        import ezc3d
    except ImportError as error:
        raise NotAvailableError(
            "c3d.not_installed",
            "C3D needs the package ezc3d, which is built on this system: pip install ezc3d, with "
            "a C++ compiler and CMake; or use TRC",
        ) from error
    return ezc3d


def read(path: Path) -> dict[str, Any]:
    """Return the arrays of `c3d.read_c3d`; positions in the file's unit and axes, NaN = a gap.

    Raises:
        NotAvailableError: as `load_ezc3d`.
        FormatError: no C3D, truncated, damaged, or without points.
    """
    _check_header(path)
    ezc3d = load_ezc3d()
    try:
        file = ezc3d.c3d(str(path))
    except (RuntimeError, ValueError, OSError, MemoryError, IndexError, KeyError) as error:
        reason = " ".join(str(error).split())[:200]
        raise FormatError(
            "animation.damaged", "{path} is damaged: {error}; export it again", path=path, error=reason
        ) from error
    points = file["parameters"]["POINT"]

    def text(name: str) -> str:
        values = points[name]["value"] if name in points else []
        return str(values[0]) if len(values) else ""

    groups = ["LABELS", *(f"LABELS{k}" for k in range(2, 100))]
    labels = [str(label) for group in groups if group in points for label in points[group]["value"]]
    values = np.asarray(file["data"]["points"])[:3].transpose(2, 1, 0)
    residuals = np.asarray(file["data"]["meta_points"]["residuals"])[0].T
    labels = (labels + [""] * values.shape[1])[: values.shape[1]]
    positions = np.where((residuals < 0)[..., None] | ~np.isfinite(values), np.nan, values)
    if not labels or len(positions) == 0:
        raise FormatError(
            "c3d.no_points", "{path} has no points in any frame; give a C3D file with points", path=path
        )
    return {
        "labels": np.array(labels),
        "unit": np.array(text("UNITS")),
        "rate": np.array(float(points["RATE"]["value"][0])),
        "up": np.array(text("Y_SCREEN")),
        "positions": positions.astype(np.float32),
    }


def _check_header(path: Path) -> None:
    """Refuse a file that is no C3D, and counts that exceed the file's length, before memory is allocated."""
    header = path.read_bytes()[:512]
    if len(header) < 512 or header[1] != 0x50:
        raise FormatError(
            "c3d.not_c3d",
            "{path} is not a C3D file: its header says nothing of the kind; give a C3D file",
            path=path,
        )
    little = True
    with path.open("rb") as file:
        file.seek((max(header[0], 1) - 1) * 512)
        block = file.read(4)
        size = file.seek(0, 2)
    if len(block) < 4:
        raise FormatError(
            "c3d.no_parameters", "{path} is cut off before its parameters; copy or export it again", path=path
        )
    little = block[3] != 86  # 84 = Intel, 85 = DEC, 86 = SGI
    order = "little" if little else "big"

    def word(number: int) -> int:
        return int.from_bytes(header[2 * number - 2 : 2 * number], order)

    count, first, last, start = word(2), word(4), word(5), word(9)
    floats = (header[15] if block[3] != 86 else header[12]) & 0x80  # the sign of the scale factor
    frame = count * 4 * (4 if floats else 2) + word(3) * (4 if floats else 2)
    frames = last - first + 1
    if count == 0 or frames <= 0:
        raise FormatError(
            "c3d.no_points", "{path} has no points in any frame; give a C3D file with points", path=path
        )
    if (start - 1) * 512 + frame * frames > size:
        raise FormatError(
            "c3d.cut_off",
            "{path} is cut off: it has {n} bytes, and {count} points in {frames} frames need "
            "{needed}; copy or export it again",
            path=path,
            n=size,
            count=count,
            frames=frames,
            needed=(start - 1) * 512 + frame * frames,
        )


if __name__ == "__main__":
    work(read)
