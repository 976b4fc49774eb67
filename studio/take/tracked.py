"""`tracked/`: the skeletons that tracking made of a take's depth images, so that it is tracked once, not every solve.

What is kept can be made again from `raw.mcap` at any time: a file that cannot be read, that is of other frames, of
another calibration or of another tracker counts as absent, and one that cannot be written is done without.
"""

import json
import logging
import zlib
from dataclasses import dataclass
from functools import cache
from hashlib import blake2b
from pathlib import Path
from typing import Any
from zipfile import BadZipFile

import numpy as np

from studio.engine import tracker
from studio.engine.arrays import read_arrays, save_arrays
from studio.engine.calibration.result import Performer, performer_from_json, performer_to_json
from studio.engine.errors import FormatError, StudioError
from studio.engine.files import write_atomically
from studio.engine.frames import CameraFrame
from studio.engine.versions import TRACKED
from studio.take.take import Take

FOLDER = "tracked"
_KEYS = ("origin", "camera", "performer", "sequence", "device_time_ns", "positions", "confidence")
_log = logging.getLogger(__name__)


@dataclass(frozen=True)
class Tracked:
    """One camera's skeletons of a whole take, and the performer as tracking knew them at its end."""

    frames: list[CameraFrame]
    performer: Performer | None = None


def read_tracked(take: Take, name: str, made_with: Any = None) -> Tracked | None:
    """Return the skeletons kept as `name`; None where there are none, or none of these frames and this tracker.

    Args:
        made_with: what the skeletons depend on beside the frames and the tracker, as JSON has it.
    """
    try:
        kept = read_arrays(_file(take, name), _KEYS, TRACKED)
        if str(kept["origin"]) != _origin(take, made_with):
            return None
        camera, performer = str(kept["camera"]), json.loads(str(kept["performer"]))
        numbers, times_ns = kept["sequence"].tolist(), kept["device_time_ns"].tolist()
        rows = zip(numbers, times_ns, kept["positions"], kept["confidence"], strict=True)
        frames = [CameraFrame(camera, *row) for row in rows]
        return Tracked(frames, None if performer is None else performer_from_json(performer))
    except (OSError, EOFError, KeyError, TypeError, ValueError, FormatError, BadZipFile, zlib.error):
        return None


def keep_tracked(take: Take, name: str, tracked: Tracked, made_with: Any = None) -> None:
    """Keep skeletons as `name`, in the place of what was kept so before; a disk that is full leaves none."""
    if not tracked.frames:
        return
    frames, performer = tracked.frames, tracked.performer
    columns = {
        "origin": _origin(take, made_with),
        "camera": frames[0].camera,
        "performer": json.dumps(None if performer is None else performer_to_json(performer)),
        "sequence": np.array([frame.sequence for frame in frames], dtype=np.int64),
        "device_time_ns": np.array([frame.device_time_ns for frame in frames], dtype=np.int64),
        "positions": np.stack([frame.positions for frame in frames]),
        "confidence": np.stack([frame.confidence for frame in frames]),
    }
    try:
        with write_atomically(_file(take, name)) as file:
            save_arrays(file, columns, TRACKED)
    except StudioError as error:
        _log.warning("the tracked skeletons are not kept, the next solve tracks again: %s", error)


def _file(take: Take, name: str) -> Path:
    return take.path / FOLDER / f"{name}.npz"


def _origin(take: Take, made_with: Any) -> str:
    """Return what skeletons come from: the frames on the disk, the tracker, and what else it was given."""
    raw = take.raw_path.stat()
    return json.dumps([raw.st_size, raw.st_mtime_ns, _tracker(), made_with])


@cache
def _tracker() -> str:
    """Return a name of the tracker as it is: one whose code was changed makes other skeletons."""
    digest = blake2b(digest_size=8)
    for file in sorted(Path(tracker.__file__).parent.glob("*.py")):
        digest.update(file.read_bytes())
    return digest.hexdigest()
