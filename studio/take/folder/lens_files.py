"""Files with lenses: the studio's own calibrations, and those of OpenCV, Pose2Sim, FreeMoCap and others.

- JSON: `intrinsics` of a calibration (`fx`, `fy`, `cx`, `cy`, `width`, `height`, `distortion`), a whole one, or
  OpenCV's matrix (`camera_matrix` and `image_size`, maybe `distortion_coefficients`).
- TOML of Pose2Sim, FreeMoCap and Anipose: a table per camera with `name`, `size`, `matrix` and `distortions`.
"""

import json
import tomllib
from pathlib import Path
from typing import Any

import numpy as np

from studio.engine.base.errors import FormatError
from studio.engine.model.calibration import lens_from_json
from studio.engine.model.cameras.lens import Lens

_MOST_BYTES = 16 << 20
_MATRIX = ("matrix", "camera_matrix", "K", "mtx")
_SIZE = ("size", "image_size", "resolution")
_DISTORTION = ("distortions", "distortion", "distortion_coefficients", "dist_coeffs", "dist")


def read_lenses(file: str | Path) -> dict[str, Lens]:
    """Return the lenses in a file by the names of their cameras; "" for a lens without a name.

    Raises:
        FormatError: there is no such file, it cannot be read, or has no lens.
    """
    path = Path(file)
    try:
        if path.stat().st_size > _MOST_BYTES:
            raise ValueError("it is too large")
        text = path.read_text(encoding="utf-8")
    except (OSError, ValueError) as error:
        raise _unreadable(path, error) from error
    return lenses_in(path, text)


def lenses_in(file: str | Path, text: str) -> dict[str, Lens]:
    """Return the lenses in the text of a file, as `read_lenses`.

    Raises:
        FormatError: it cannot be read, or has no lens.
    """
    toml = str(file).lower().endswith(".toml")
    try:
        found = _lenses(tomllib.loads(text) if toml else json.loads(text))
        if not found:
            raise ValueError("it has no lens")
    except (ValueError, TypeError, KeyError, RecursionError) as error:
        raise _unreadable(file, error) from error
    return found


def _unreadable(file: str | Path, error: Exception) -> FormatError:
    return FormatError(
        "calibration.lens_file",
        "{path} has no lens that can be read ({error}); give the JSON of a calibration, or a .toml of Pose2Sim "
        "or FreeMoCap",
        path=file,
        error=str(error) or type(error).__name__,
    )


def lens_for(camera: str, file: str | Path) -> Lens:
    """Return the lens of a camera in a file; the only one, if there is only one.

    Raises:
        FormatError: as for `read_lenses`, or none of several is of that camera.
    """
    return lens_among(camera, file, read_lenses(file))


def lens_among(camera: str, file: str | Path, found: dict[str, Lens]) -> Lens:
    """Return the lens of a camera among those found in a file; the only one, if there is only one.

    Raises:
        FormatError: none of several is of that camera.
    """
    if camera in found:
        return found[camera]
    if len(found) == 1:
        return next(iter(found.values()))
    raise FormatError(
        "calibration.lens_of_other",
        "{path} has the lenses of {others}, none of {name}: rename one, or make a file with one lens",
        path=file,
        others=[*found],
        name=camera,
    )


def _lenses(content: Any) -> dict[str, Lens]:
    if not isinstance(content, dict):
        raise ValueError("it is no object")
    if "cameras" in content:
        cameras = content["cameras"].items()
        return {name: lens_from_json(one["intrinsics"]) for name, one in cameras if one.get("intrinsics")}
    lens = _lens(content)
    if lens is not None:
        return {"": lens}
    found = {}
    for key, one in content.items():
        lens = _lens(one) if isinstance(one, dict) else None
        if lens is not None:
            found[str(one.get("name") or key)] = lens
    return found


def _lens(value: dict[str, Any]) -> Lens | None:
    """Return the lens that a table has, None if it has none."""
    if isinstance(value.get("intrinsics"), dict):
        return lens_from_json(value["intrinsics"])
    if "fx" in value:
        return lens_from_json(value)
    matrix = _first(value, _MATRIX)
    if matrix is None:
        return None
    matrix = matrix["data"] if isinstance(matrix, dict) else matrix
    (fx, _, cx), (_, fy, cy), _ = np.array(matrix, np.float64).reshape(3, 3).tolist()
    size = _first(value, _SIZE)
    width, height = size if size is not None else (value["image_width"], value["image_height"])
    bend = _first(value, _DISTORTION)
    bend = bend["data"] if isinstance(bend, dict) else bend
    distortion = np.array([] if bend is None else bend, np.float64).ravel().tolist()
    return lens_from_json(
        {"fx": fx, "fy": fy, "cx": cx, "cy": cy, "width": width, "height": height, "distortion": distortion}
    )


def _first(value: dict[str, Any], keys: tuple[str, ...]) -> Any:
    return next((value[key] for key in keys if key in value), None)
