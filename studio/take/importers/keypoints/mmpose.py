"""JSON of MMPose, with which RTMPose is run, and of AlphaPose.

MMPose's inferencer writes a file per video, a list of `{"frame_id", "instances"}`, or a file per picture, a list of
instances; its demos write `{"meta_info", "instance_info"}`. An instance has `keypoints`, a list of x and y, and
`keypoint_scores`. AlphaPose writes one list of people, each with `image_id` and flat `keypoints`.
"""

import json
import re
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from studio.take.importers.keypoints.points import Detections, broken, checked
from studio.take.importers.videos import camera_name

_NUMBER = re.compile(r"(\d+)\D*$")
_MOST_BYTES = 1 << 30
_HEAD = 65536
_BESIDE = ("calibration.json", "recording.json")
_ALPHAPOSE = "alphapose-results.json"
_FOLDERS = (".", "predictions")


def cameras(path: Path) -> dict[str, Path]:
    """Return the files, or folders of files, of cameras by the cameras' names; empty where there are none."""
    for place in (path / one for one in _FOLDERS):
        files = [file for file in sorted(place.glob("*.json")) if file.name not in _BESIDE and _is_one(file)]
        if files:
            return {_name(file.with_name(file.name.removeprefix("results_"))): file for file in files}
        folders = {}
        for folder in sorted(place.glob("*/")):
            inside = sorted(folder.glob("*.json"))
            if (folder / _ALPHAPOSE).is_file():
                folders[_name(folder)] = folder / _ALPHAPOSE
            elif inside and _NUMBER.search(inside[0].stem) and _is_one(inside[0]):
                folders[_name(folder)] = folder
        if folders:
            return folders
    return {}


def _name(path: Path) -> str:
    return camera_name(path if path.suffix else path.with_name(f"{path.name}.json"))


def _is_one(file: Path) -> bool:
    with file.open(encoding="utf-8", errors="replace") as content:
        head = content.read(_HEAD)
    return '"keypoints"' in head or '"instance_info"' in head or '"meta_info"' in head


def read(path: Path) -> Detections:
    """Return the detections in a camera's pictures.

    Args:
        path: a file, or a folder with a file per picture.

    Raises:
        FormatError: a damaged file, or points of an unknown kind.
    """
    if path.is_file():
        return Detections(path, _frames(path, _json(path)))
    frames: dict[int, list[NDArray[np.float64]]] = {}
    for file in sorted(path.glob("*.json")):
        number = _NUMBER.search(file.stem)
        if number is not None:
            frames[int(number.group(1))] = _people(file, _json(file))
    return Detections(path, frames)


def _json(file: Path) -> Any:
    try:
        if file.stat().st_size > _MOST_BYTES:
            raise ValueError("it is too large")
        return json.loads(file.read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError) as error:
        raise broken(file, error) from error


def _frames(file: Path, content: Any) -> dict[int, list[NDArray[np.float64]]]:
    """Return the people in a file by picture."""
    out: dict[int, list[NDArray[np.float64]]] = {}
    try:
        if isinstance(content, dict):
            content = content["instance_info"] if "instance_info" in content else content["predictions"]
        for place, one in enumerate(content):
            if isinstance(one, dict) and "image_id" in one:
                number = _number_of(one["image_id"])
                out.setdefault(number, []).extend(_people(file, [one]))
            elif isinstance(one, dict):
                out[int(one["frame_id"])] = _people(file, one["instances"])
            else:
                out[place] = _people(file, one)
    except (ValueError, TypeError, KeyError) as error:
        raise broken(file, error) from error
    return out


def _number_of(image: object) -> int:
    found = _NUMBER.search(Path(str(image)).stem)
    if found is None:
        raise ValueError(f"the picture {str(image)[:40]!r} has no number")
    return int(found.group(1))


def _people(file: Path, instances: Iterable[Any]) -> list[NDArray[np.float64]]:
    try:
        people = [_points(one) for one in instances]
    except (ValueError, TypeError, KeyError) as error:
        raise broken(file, error) from error
    return checked(people, file)


def _points(instance: Any) -> NDArray[np.float64]:
    """Return a person's points."""
    points = np.array(instance["keypoints"], np.float64)
    if "keypoint_scores" not in instance:
        return points.reshape(-1, 3)
    sure = np.array(instance["keypoint_scores"], np.float64).reshape(-1, 1)
    return np.concatenate([points.reshape(len(sure), 2), sure], axis=1)
