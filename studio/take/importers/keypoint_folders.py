"""Landmarks that another program found: OpenPose's JSON files, a folder per camera with a file per frame.

OpenPose writes them (BODY_25), and so do Pose2Sim and Sports2D with RTMPose (COCO_17, HALPE_26, COCO_133), in
the folder `pose` of a project. The points become those of BlazePose that are at the same places. Times and
picture sizes are those of the videos of the same names; without videos `recording.json` says them.
"""

import json
import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from studio.engine.base.errors import FormatError
from studio.engine.model.joints import JOINT_SETS
from studio.take.importers.camera_folders import read_beside
from studio.take.importers.recording import Progress, ReadCamera, ReadRecording
from studio.take.importers.videos import camera_name
from studio.take.video.file import VideoFile, is_video
from studio.take.video.landmarks import JOINT_SET
from studio.wire import LandmarkArrays

DEVICE = "landmarks of another program"

_BODY = (
    "nose", "left_eye", "right_eye", "left_ear", "right_ear", "left_shoulder", "right_shoulder", "left_elbow",
    "right_elbow", "left_wrist", "right_wrist", "left_hip", "right_hip", "left_knee", "right_knee", "left_ankle",
    "right_ankle",
)  # fmt: skip
_COCO = {name: place for place, name in enumerate(_BODY)}

PLACES: dict[int, dict[str, int]] = {
    17: _COCO,
    25: {
        "nose": 0, "right_shoulder": 2, "right_elbow": 3, "right_wrist": 4, "left_shoulder": 5, "left_elbow": 6,
        "left_wrist": 7, "right_hip": 9, "right_knee": 10, "right_ankle": 11, "left_hip": 12, "left_knee": 13,
        "left_ankle": 14, "right_eye": 15, "left_eye": 16, "right_ear": 17, "left_ear": 18, "left_foot_index": 19,
        "left_heel": 21, "right_foot_index": 22, "right_heel": 24,
    },
    26: {**_COCO, "left_foot_index": 20, "right_foot_index": 21, "left_heel": 24, "right_heel": 25},
    133: {**_COCO, "left_foot_index": 17, "left_heel": 19, "right_foot_index": 20, "right_heel": 22},
}  # fmt: skip
"""By the number of points that a program finds (COCO_17, BODY_25, HALPE_26, COCO_133): where each landmark of
BlazePose is among them."""

_NUMBER = re.compile(r"(\d+)(_keypoints)?\.json")
_MOST_BYTES = 4 << 20
_MOST_FRAMES = 10_000_000


@dataclass(frozen=True)
class _Film:
    """When a camera took its pictures, and how large they are."""

    times_ns: NDArray[np.int64]
    width: int
    height: int


def matches(path: Path) -> bool:
    """Whether `path` is a folder with a folder of such files, or has such folders in `pose`."""
    return path.is_dir() and bool(camera_folders(path))


def read(path: Path, progress: Progress) -> ReadRecording:
    """Return the landmarks of all cameras; of several people the one nearest to the one before is kept.

    Raises:
        FormatError: a damaged file, points of an unknown kind, or no video and no word on the times.
    """
    folders = camera_folders(path)
    notes: list[str] = []
    cameras = []
    for k, (name, folder) in enumerate(folders.items()):
        cameras.append(_camera(path, name, folder, notes))
        progress((k + 1) / len(folders))
    return read_beside(path, tuple(cameras), notes)


def camera_folders(path: Path) -> dict[str, Path]:
    """Return the folders of cameras by the cameras' names."""
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


def _camera(path: Path, name: str, folder: Path, notes: list[str]) -> ReadCamera:
    files = {
        int(found.group(1)): file
        for file in folder.glob("*.json")
        if (found := _NUMBER.search(file.name)) is not None
    }
    film = _film(path, name, max(files) + 1)
    first = 0 if max(files) < len(film.times_ns) else min(files)  # some programs count from 1
    count, names = len(JOINT_SETS[JOINT_SET]), JOINT_SETS[JOINT_SET]
    frames = [number for number in sorted(files) if number - first < len(film.times_ns)]
    pixels = np.full((len(frames), count, 2), np.nan)
    visibility = np.zeros((len(frames), count))
    before: NDArray[np.float64] | None = None
    most = 0
    for k, number in enumerate(frames):
        people = _people(files[number])
        most = max(most, len(people))
        if not people:
            continue
        before = _same(people, before, film)
        for landmark, place in PLACES[len(before)].items():
            x, y, sure = before[place]
            if sure > 0 and np.isfinite(before[place]).all():
                pixels[k, names.index(landmark)] = x, y
                visibility[k, names.index(landmark)] = min(sure, 1.0)
    notes.append(f"{name}: {len(frames)} frames of landmarks from {folder.name}")
    if most > 1:
        notes.append(f"{name}: up to {most} people in a frame; the one nearest to the one before was kept")
    return ReadCamera(
        name=name,
        device=DEVICE,
        joint_set=JOINT_SET,
        times_ns=film.times_ns[np.array(frames, np.int64) - first],
        positions=np.full((len(frames), count, 3), np.nan),
        confidence=visibility,
        landmarks=[LandmarkArrays(film.width, film.height, one) for one in pixels],
    )


def _people(file: Path) -> list[NDArray[np.float64]]:
    """Return everybody's points in a frame: x, y [pixels] and confidence, shape (count, 3)."""
    try:
        if file.stat().st_size > _MOST_BYTES:
            raise ValueError("it is too large")
        found = json.loads(file.read_text(encoding="utf-8"))["people"]
        people = [np.array(one["pose_keypoints_2d"], np.float64).reshape(-1, 3) for one in found]
    except (OSError, ValueError, TypeError, KeyError, RecursionError) as error:
        raise FormatError(
            "import.keypoints_broken", "{path} is no file of OpenPose ({error}); mend or remove it", path=file,
            error=str(error) or type(error).__name__,
        ) from error  # fmt: skip
    people = [one for one in people if len(one) and (one[:, 2] > 0).any()]
    unknown = {len(one) for one in people} - PLACES.keys()
    if unknown:
        raise FormatError(
            "import.keypoints_kind",
            "{path} has {n} points a person; known: {known} (COCO_17, BODY_25, HALPE_26, COCO_133)",
            path=file,
            n=min(unknown),
            known=[*map(str, PLACES)],
        )
    return people


def _same(
    people: list[NDArray[np.float64]], before: NDArray[np.float64] | None, film: _Film
) -> NDArray[np.float64]:
    """Return who is nearest to the person of the frame before, or at first to the picture's middle."""
    there = np.array([0.5 * film.width, 0.5 * film.height]) if before is None else _middle(before)
    return min(people, key=lambda one: float(np.linalg.norm(_middle(one) - there)))


def _middle(person: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.average(person[:, :2], axis=0, weights=np.maximum(person[:, 2], 0.0) + 1e-9)


def _film(path: Path, name: str, count: int) -> _Film:
    """Return times and picture size of a camera: from its video, else from `recording.json`."""
    for place in (path / "videos", path):
        for file in sorted(place.glob("*.*")):
            if camera_name(file) == name and is_video(file):
                video = VideoFile.open(file)
                return _Film(video.times_ns(), *video.size())
    try:
        said: Any = json.loads((path / "recording.json").read_text(encoding="utf-8"))
        width, height = (int(one) for one in said["image_size"])
        rate = float(said["frames_per_second"])
        if not (
            16 <= width <= 16384 and 16 <= height <= 16384 and 1 <= rate <= 1000 and count <= _MOST_FRAMES
        ):
            raise ValueError("a number is out of range")
    except (OSError, ValueError, TypeError, KeyError, OverflowError, RecursionError) as error:
        raise FormatError(
            "import.keypoints_no_video",
            "{path}: the landmarks of {name} have no times and no picture size ({error}): put its video into "
            'videos/, or write recording.json with {{"frames_per_second": 60, "image_size": [1920, 1080]}}',
            path=path,
            name=name,
            error=str(error) or type(error).__name__,
        ) from error
    return _Film(np.round(np.arange(count) * 1e9 / rate).astype(np.int64), width, height)
