"""The videos that a take keeps: `video/<camera>/<number>.<ending>`, each with its `<number>.json`.

The JSON has the camera, the start of its client, and by frame the time in the file and the capture time on the
camera's clock. A camera's video is one file (an import) or several, one after the other (a recording).
"""

import json
import os
import shutil
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from studio.engine.base.errors import FormatError, TakeError
from studio.engine.base.files import write_json
from studio.engine.base.sentences import system_says
from studio.engine.base.versions import KEPT_VIDEO
from studio.take.folder.names import inside, is_safe_name
from studio.take.folder.take import Take
from studio.take.video.file import ENDINGS

FOLDER = "video"
KEPT_FREE_BYTES = 256 << 20
"""Disk space that is left for recordings."""


@dataclass(frozen=True)
class KeptVideo:
    """One video file of a take.

    Attributes:
        path: its file.
        camera: name of the camera.
        boot_id: start of the client that recorded it; `import` for an import.
        from_sequence: number of the first frame of landmarks that the client sent after it began to record.
        at_ns: time of each frame in the file, as `VideoFile.frames` gives it [ns], increasing, shape (frame_count,).
        times_ns: capture time of each on the clock of that start [ns], increasing, shape (frame_count,).
    """

    path: Path
    camera: str
    boot_id: str
    from_sequence: int
    at_ns: NDArray[np.int64]
    times_ns: NDArray[np.int64]


def kept_videos(take: Path) -> dict[str, list[KeptVideo]]:
    """Return the videos in a take's folder, by camera in the order of their numbers.

    Files without a description, and descriptions that cannot be read or have no file, are passed over.
    """
    found: dict[str, list[KeptVideo]] = {}
    for described in sorted((take / FOLDER).glob("*/*.json"), key=lambda file: (file.parent.name, file.name)):
        video = _read(described)
        if video is not None:
            found.setdefault(video.camera, []).append(video)
    return found


def has_video(take: Path) -> bool:
    """Whether a take keeps any video."""
    return any((take / FOLDER).glob("*/*.json"))


def video_bytes(take: Path) -> int:
    """Return the size of a take's videos [bytes]."""
    return sum(file.stat().st_size for file in (take / FOLDER).glob("*/*") if file.is_file())


def keep_video(
    take: Take,
    file: Path,
    *,
    camera: str,
    boot_id: str,
    at_ns: NDArray[np.int64],
    times_ns: NDArray[np.int64],
    from_sequence: int = 0,
    number: int | None = None,
    moved: bool = False,
) -> KeptVideo:
    """Put a video into a take, and return it.

    The file is linked where it lies on the same disk, else copied.

    Args:
        file: the video; its ending stays.
        number: its number; None = after the existing ones. A video of that number is replaced.
        moved: `file` is the studio's own, and is moved.
        camera, boot_id, at_ns, times_ns, from_sequence: as in `KeptVideo`.

    Raises:
        FormatError: an ending that no video has, or times that do not fit each other.
        TakeError: the disk is full or cannot be written.
    """
    if file.suffix.lower() not in ENDINGS:
        raise FormatError(
            "video.ending",
            "{name} is no video by its ending; allowed: {allowed}",
            name=file.name[:80],
            allowed=[*ENDINGS],
        )
    if not _good_times(at_ns) or not _good_times(times_ns) or len(at_ns) != len(times_ns):
        raise FormatError(
            "video.times", "{name}: the times of its frames must increase, one per frame", name=file.name[:80]
        )
    folder = inside(take.path, FOLDER, camera if is_safe_name(camera) else f"{camera}_")
    try:
        folder.mkdir(parents=True, exist_ok=True)
        if number is None:
            number = 1 + max(
                (int(one.stem) for one in folder.glob("*.json") if one.stem.isdigit()), default=0
            )
        path = folder / f"{number:05d}{file.suffix.lower()}"
        _place(file, path, moved=moved)
    except OSError as error:
        raise TakeError(
            "video.not_kept",
            "the video of {camera} is not kept in {take}: {error}; free some space",
            camera=camera,
            take=take.path,
            error=system_says(error),
        ) from error
    video = KeptVideo(path, camera, boot_id, from_sequence, at_ns, times_ns)
    write_json(path.with_suffix(".json"), _to_json(video))
    os.utime(take.path / FOLDER)  # the list of takes checks it
    return video


def all_times_ns(videos: Sequence[KeptVideo]) -> NDArray[np.int64]:
    """Return the capture times of all frames of a camera's videos, each on the clock of its start [ns]."""
    return np.concatenate([video.times_ns for video in videos]) if videos else np.empty(0, np.int64)


def numbered(videos: Sequence[KeptVideo], number: int) -> tuple[KeptVideo, int]:
    """Return the video with a frame, and the frame's time in that file [ns]; frames count through all videos.

    Raises:
        IndexError: there is no such frame.
    """
    for video in videos:
        if 0 <= number < len(video.at_ns):
            return video, int(video.at_ns[number])
        number -= len(video.at_ns)
    raise IndexError(number)


def _place(file: Path, path: Path, *, moved: bool) -> None:
    """Bring a file to its place; a reader finds it complete or not at all."""
    if moved:
        os.replace(file, path)
        return
    partial = path.with_name(f".{path.name}.partial")
    partial.unlink(missing_ok=True)
    try:
        os.link(file.resolve(), partial)
    except OSError:  # another disk, or one without links
        try:
            shutil.copyfile(file, partial)
        except OSError:
            partial.unlink(missing_ok=True)
            raise
    os.replace(partial, path)


def _to_json(video: KeptVideo) -> dict[str, object]:
    return KEPT_VIDEO.stamped(
        {
            "file": video.path.name,
            "camera": video.camera,
            "boot_id": video.boot_id,
            "from_sequence": video.from_sequence,
            "at_ns": video.at_ns.tolist(),
            "times_ns": video.times_ns.tolist(),
        }
    )


def _read(described: Path) -> KeptVideo | None:
    try:
        value = KEPT_VIDEO.current(json.loads(described.read_text(encoding="utf-8")), described)
        path = inside(described.parent, str(value["file"]))
        at_ns, times_ns = (np.array(value[key], dtype=np.int64) for key in ("at_ns", "times_ns"))
        video = KeptVideo(
            path, str(value["camera"]), str(value["boot_id"]), int(value["from_sequence"]), at_ns, times_ns
        )
    except (OSError, KeyError, TypeError, ValueError, OverflowError, RecursionError, FormatError, TakeError):
        return None
    good = path.is_file() and path.suffix.lower() in ENDINGS and len(at_ns) == len(times_ns)
    return video if good and _good_times(at_ns) and _good_times(times_ns) else None


def _good_times(times_ns: NDArray[np.int64]) -> bool:
    return times_ns.ndim == 1 and len(times_ns) > 0 and bool((np.diff(times_ns) > 0).all())
