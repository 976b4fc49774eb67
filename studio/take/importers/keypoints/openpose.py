"""OpenPose's JSON files: a folder per camera, a file per picture.

OpenPose writes them (BODY_25), and so do Pose2Sim and Sports2D with RTMPose (COCO_17, HALPE_26, COCO_133), in the
folder `pose` of a project.
"""

import json
import re
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from studio.take.importers.keypoints.points import Detections, broken, checked
from studio.take.importers.videos import camera_name

_NUMBER = re.compile(r"(\d+)(_keypoints)?\.json")
_MOST_BYTES = 4 << 20


def cameras(path: Path) -> dict[str, Path]:
    """Return the folders of cameras by the cameras' names; empty where there are none."""
    for place in (path, path / "pose"):
        found = {
            camera_name(folder.with_name(f"{folder.name.removesuffix('_json')}.json")): folder
            for folder in sorted(place.glob("*/"))
            if folder.is_dir() and any(map(_is_frame, sorted(folder.glob("*.json"))[:1]))
        }
        if found:
            return found
    return {}


def _is_frame(file: Path) -> bool:
    if _NUMBER.search(file.name) is None:
        return False
    with file.open(encoding="utf-8", errors="replace") as content:
        return '"people"' in content.read(1000)


def read(folder: Path) -> Detections:
    """Return the detections in a camera's pictures.

    Raises:
        FormatError: a damaged file, or points of an unknown kind.
    """
    return Detections(
        folder,
        {
            int(found.group(1)): _people(file)
            for file in folder.glob("*.json")
            if (found := _NUMBER.search(file.name)) is not None
        },
    )


def _people(file: Path) -> list[NDArray[np.float64]]:
    """Return everybody's points in a picture."""
    try:
        if file.stat().st_size > _MOST_BYTES:
            raise ValueError("it is too large")
        found = json.loads(file.read_text(encoding="utf-8"))["people"]
        people = [np.array(one["pose_keypoints_2d"], np.float64).reshape(-1, 3) for one in found]
    except (OSError, ValueError, TypeError, KeyError, RecursionError) as error:
        raise broken(file, error) from error
    return checked(people, file)
