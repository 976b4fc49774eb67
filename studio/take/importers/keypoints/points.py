"""Which points of other pose networks are landmarks of BlazePose."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from studio.engine.base.errors import FormatError
from studio.engine.model.joints import JOINT_SETS
from studio.take.video.landmarks import JOINT_SET, LANDMARKS

_BODY = (
    "nose", "left_eye", "right_eye", "left_ear", "right_ear", "left_shoulder", "right_shoulder", "left_elbow",
    "right_elbow", "left_wrist", "right_wrist", "left_hip", "right_hip", "left_knee", "right_knee", "left_ankle",
    "right_ankle",
)  # fmt: skip
_COCO = {name: place for place, name in enumerate(_BODY)}
_HALPE = {**_COCO, "left_foot_index": 20, "right_foot_index": 21, "left_heel": 24, "right_heel": 25}

PLACES: dict[int, dict[str, int]] = {
    17: _COCO,
    25: {
        "nose": 0, "right_shoulder": 2, "right_elbow": 3, "right_wrist": 4, "left_shoulder": 5, "left_elbow": 6,
        "left_wrist": 7, "right_hip": 9, "right_knee": 10, "right_ankle": 11, "left_hip": 12, "left_knee": 13,
        "left_ankle": 14, "right_eye": 15, "left_eye": 16, "right_ear": 17, "left_ear": 18, "left_foot_index": 19,
        "left_heel": 21, "right_foot_index": 22, "right_heel": 24,
    },
    26: _HALPE,
    33: {name: place for place, name in enumerate(JOINT_SETS[JOINT_SET])},
    133: {**_COCO, "left_foot_index": 17, "left_heel": 19, "right_foot_index": 20, "right_heel": 22},
    136: _HALPE,
}  # fmt: skip
"""Index of each landmark of BlazePose among a program's points, by their number. The sets are COCO_17, BODY_25,
HALPE_26, BlazePose, COCO_133 and HALPE_136."""

_NAMES = JOINT_SETS[JOINT_SET]
_FEET = "left_heel"


@dataclass(frozen=True)
class Detections:
    """Detections by another program in the pictures of one camera.

    Attributes:
        path: its file or folder.
        frames: by the number of the picture, the points of all people in it: x, y [pixels] and confidence, shape
            (point_count, 3) each.
        size: width and height of the pictures [pixels]; None = unknown.
        together: the picture numbers of all cameras follow one clock.
    """

    path: Path
    frames: Mapping[int, list[NDArray[np.float64]]]
    size: tuple[int, int] | None = None
    together: bool = False


def checked(people: list[NDArray[np.float64]], path: Path) -> list[NDArray[np.float64]]:
    """Return the people with at least one found point.

    Raises:
        FormatError: points of an unknown kind.
    """
    people = [one for one in people if len(one) and (one[:, 2] > 0).any()]
    unknown = {len(one) for one in people} - PLACES.keys()
    if unknown:
        raise FormatError(
            "import.keypoints_kind",
            "{path} has {n} points a person; known: {known} (COCO_17, BODY_25, HALPE_26, BlazePose, COCO_133, "
            "HALPE_136)",
            path=path,
            n=min(unknown),
            known=[*map(str, PLACES)],
        )
    return people


def to_blazepose(person: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the pixels of the 33 landmarks, shape (33, 2), NaN = unseen, and how visible they are, shape (33,)."""
    pixels, visibility = np.full((LANDMARKS, 2), np.nan), np.zeros(LANDMARKS)
    for name, place in PLACES[len(person)].items():
        x, y, sure = person[place]
        if sure > 0 and np.isfinite(person[place]).all():
            pixels[_NAMES.index(name)] = x, y
            visibility[_NAMES.index(name)] = min(sure, 1.0)
    return pixels, visibility


def has_feet(person: NDArray[np.float64]) -> bool:
    """Whether heels and toes are among a person's points."""
    return _FEET in PLACES[len(person)]


def broken(path: Path, error: object) -> FormatError:
    """Return the error of a file that cannot be read as landmarks."""
    return FormatError(
        "import.keypoints_broken",
        "{path} is no file of landmarks that can be read ({error}); mend or remove it",
        path=path,
        error=str(error) or type(error).__name__,
    )
