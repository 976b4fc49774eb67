"""A camera's depth as 16-bit PNG: `camera.json` with the intrinsics, `depth.txt` with a time and a file per line.

`camera.json`: `width`, `height`, `fx`, `fy`, `cx`, `cy` [px], optional `distortion` (OpenCV's order), `sensor`,
`fps`, and `depth_unit_m`, the unit of the PNG (default 0.001). A line of `depth.txt` is the capture time on
the camera's clock [s], a blank, and the file's name in the folder.
"""

import json
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
from numpy.typing import NDArray
from PIL import Image

from studio import wire
from studio.engine.base.errors import FormatError
from studio.engine.base.sentences import say
from studio.take.importers.recording import DepthStream, ReadDepth, put_in_order, seconds_to_ns
from studio.take.importers.table import number

_IMAGE_ERRORS = (OSError, SyntaxError, ValueError, Image.DecompressionBombError)


def read_depth(folder: Path, notes: list[str]) -> ReadDepth:
    """Return a camera's depth images; the files are read with the stream.

    Args:
        folder: with `camera.json` and `depth.txt`.
        notes: receives omissions and choices, also while the stream is read.

    Raises:
        FormatError: a damaged `camera.json` or `depth.txt`; the message names file and line.
    """
    about, intrinsics = _camera(folder / "camera.json")
    times, files = _list(folder / "depth.txt")
    order = put_in_order(folder.name, times, notes)
    times_ns, files = times[order], [files[k] for k in order]
    step_mm = about["depth_unit_m"] * 1e3

    def stream() -> DepthStream:
        broken: list[str] = []
        for time_ns, file in zip(times_ns.tolist(), files, strict=True):
            try:
                yield time_ns, read_png(file, intrinsics, step_mm)
            except FormatError as error:
                broken.append(str(error))
        if broken:
            notes.append(
                f"{folder.name}: {len(broken)} of {len(files)} images left out; the first: {broken[0]}"
            )

    gaps_s = np.diff(times_ns) * 1e-9
    return ReadDepth(
        device=about["sensor"],
        intrinsics=intrinsics,
        frame_count=len(files),
        frames_per_second=float(1.0 / np.median(gaps_s)) if len(gaps_s) else about["fps"],
        stream=stream,
    )


def read_png(file: Path, intrinsics: wire.Intrinsics, step_mm: float = 1.0) -> NDArray[np.uint16]:
    """Return the depth [mm] in a 16-bit PNG, shape (height, width).

    Raises:
        FormatError: the file is missing, no 16-bit grey PNG, or of another size than the intrinsics.
    """
    try:
        with Image.open(file, formats=("PNG",)) as image:
            if image.size != (intrinsics.width, intrinsics.height) or not image.mode.startswith("I"):
                raise FormatError(
                    "import.image_size",
                    "{path} is {width} x {height}, mode {mode}; 16-bit grey, {columns} x {rows} as in "
                    "camera.json, is needed",
                    path=file,
                    width=image.width,
                    height=image.height,
                    mode=image.mode,
                    columns=intrinsics.width,
                    rows=intrinsics.height,
                )
            values = np.array(image)
    except _IMAGE_ERRORS as error:
        raise FormatError(
            "import.not_png", "{path} cannot be read as a PNG ({error})", path=file, error=error
        ) from error
    if step_mm == 1.0 and values.dtype == np.uint16:
        return values
    return np.clip(np.rint(values * step_mm), 0, 65535).astype(np.uint16)


def _camera(file: Path) -> tuple[dict[str, Any], wire.Intrinsics]:
    try:
        value = json.loads(file.read_text(encoding="utf-8"))
        if not isinstance(value, dict):
            raise ValueError(say("import.not_an_object", "not an object"))
        keys = ("fx", "fy", "cx", "cy", "width", "height", "distortion")
        intrinsics = msgspec.convert({k: value[k] for k in keys if k in value}, wire.Intrinsics, strict=False)
        about = {
            "sensor": str(value.get("sensor", "depth camera")),
            "fps": float(value.get("fps", 30.0)),
            "depth_unit_m": float(value.get("depth_unit_m", 0.001)),
        }
    except (OSError, ValueError, TypeError, RecursionError, msgspec.ValidationError) as error:
        raise FormatError(
            "import.camera_json",
            "{path}: {error}; needed: width, height, fx, fy, cx, cy, and optionally distortion, "
            "depth_unit_m, sensor, fps",
            path=file,
            error=error,
        ) from error
    numbers = np.array([intrinsics.fx, intrinsics.fy, intrinsics.cx, intrinsics.cy, *intrinsics.distortion])
    good = np.isfinite(numbers).all() and min(intrinsics.fx, intrinsics.fy) > 0 and about["fps"] > 0
    if not good or not 1e-6 < about["depth_unit_m"] < 1:
        raise FormatError(
            "import.intrinsics_numbers",
            "{path}: fx, fy, fps and depth_unit_m must be positive and all numbers finite",
            path=file,
        )
    return about, intrinsics


def _list(file: Path) -> tuple[NDArray[np.int64], list[Path]]:
    """Return the times [ns] and files that `depth.txt` lists."""
    try:
        lines = file.read_text(encoding="utf-8-sig").splitlines()
    except (OSError, UnicodeDecodeError) as error:
        raise FormatError("file.unreadable", "cannot read {path}: {error}", path=file, error=error) from error
    folder = file.parent.resolve()
    times, files = [], []
    for k, text in enumerate(lines, start=1):
        if not text.strip() or text.startswith("#"):
            continue
        time, _, name = text.strip().partition(" ")
        time_ns = seconds_to_ns(number(file, k, "time", time))
        image = (folder / name.strip()).resolve()
        if time_ns is None or not name.strip() or not image.is_relative_to(folder):
            raise FormatError(
                "import.image_line",
                "{path}:{line}: {text!r}; a line is a time [s], a blank, and a file in the folder",
                path=file,
                line=k,
                text=text[:60],
            )
        times.append(time_ns)
        files.append(image)
    if not files:
        raise FormatError("import.no_image", "{path} lists no image; a recording needs frames", path=file)
    return np.array(times, dtype=np.int64), files
