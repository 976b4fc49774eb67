"""`tracked/`: skeletons tracked from a take's depth images, stored so that solves do not track again.

They can be made again from `raw.mcap` at any time. A file that cannot be read, or belongs to other frames,
another calibration or another tracker, counts as missing. A failure to write is ignored.
"""

import json
import logging
import zlib
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any
from zipfile import BadZipFile

import numpy as np
from numpy.typing import NDArray

from studio.engine import seeing
from studio.engine.base.arrays import read_arrays, save_arrays
from studio.engine.base.errors import FormatError, StudioError
from studio.engine.base.files import code_digest, write_atomically
from studio.engine.base.versions import TRACKED
from studio.engine.model.calibration import Performer, performer_from_json, performer_to_json
from studio.engine.model.frames import CameraFrame
from studio.engine.model.solve_metrics import SolveMetrics
from studio.take.folder.take import Take

FOLDER = "tracked"
_KEYS = (
    "origin", "camera", "performer", "cameras", "sequence", "device_time_ns", "positions", "confidence", "body",
    "others",
)  # fmt: skip
_log = logging.getLogger(__name__)


@dataclass(frozen=True)
class Tracked:
    """One camera's skeletons of a whole take, the tracker's last estimate of the performer, and the refinement of the
    cameras before it, as JSON."""

    frames: list[CameraFrame]
    performer: Performer | None = None
    cameras: SolveMetrics | None = None


def read_tracked(take: Take, name: str, made_with: Any = None) -> Tracked | None:
    """Return the skeletons stored as `name`; None if there are none, or none of these frames and this tracker.

    Args:
        made_with: further inputs of the tracking besides the frames and the tracker, as JSON.
    """
    try:
        kept = read_arrays(_file(take, name), _KEYS, TRACKED)
        if str(kept["origin"]) != _origin(take, made_with):
            return None
        camera, performer = str(kept["camera"]), json.loads(str(kept["performer"]))
        cameras = json.loads(str(kept["cameras"]))
        frames = _frames(camera, kept)
        return Tracked(frames, None if performer is None else performer_from_json(performer), cameras)
    except (OSError, EOFError, KeyError, TypeError, ValueError, FormatError, BadZipFile, zlib.error):
        return None


def keep_tracked(take: Take, name: str, tracked: Tracked, made_with: Any = None) -> None:
    """Store skeletons as `name` in place of earlier ones; nothing is stored on a full disk."""
    if not tracked.frames:
        return
    performer, bodies = tracked.performer, [body for frame in tracked.frames for body in frame.bodies()]
    columns = {
        "origin": _origin(take, made_with),
        "camera": bodies[0].camera,
        "performer": json.dumps(None if performer is None else performer_to_json(performer)),
        "cameras": json.dumps(tracked.cameras),
        "sequence": np.array([body.sequence for body in bodies], dtype=np.int64),
        "device_time_ns": np.array([body.device_time_ns for body in bodies], dtype=np.int64),
        "positions": np.stack([body.positions for body in bodies]),
        "confidence": np.stack([body.confidence for body in bodies]),
        "body": np.array([body.body for body in bodies], dtype=np.int64),
        "others": np.array(
            [n for frame in tracked.frames for n in (len(frame.others), *[0] * len(frame.others))],
            dtype=np.int64,
        ),
    }
    try:
        with write_atomically(_file(take, name)) as file:
            save_arrays(file, columns, TRACKED)
    except StudioError as error:
        _log.warning("the tracked skeletons are not kept, the next solve tracks again: %s", error)


def _frames(camera: str, kept: Mapping[str, NDArray[Any]]) -> list[CameraFrame]:
    """Return the stored frames; a row is a body, and `others` is the number of further rows of its frame."""
    numbers, times_ns = kept["sequence"].tolist(), kept["device_time_ns"].tolist()
    rows = zip(numbers, times_ns, kept["positions"], kept["confidence"], kept["body"].tolist(), strict=True)
    bodies = [CameraFrame(camera, *row[:4], body=row[4]) for row in rows]
    counts = kept["others"]
    frames: list[CameraFrame] = []
    place = 0
    while place < len(bodies):
        end = place + 1 + int(counts[place])
        others = tuple(bodies[place + 1 : end])
        frames.append(replace(bodies[place], others=others) if others else bodies[place])
        place = end
    return frames


def _file(take: Take, name: str) -> Path:
    return take.path / FOLDER / f"{name}.npz"


def _origin(take: Take, made_with: Any) -> str:
    """Return an identifier of the skeletons' inputs: the frames on the disk, the tracker, and its further inputs."""
    raw = take.raw_path.stat()
    return json.dumps([raw.st_size, raw.st_mtime_ns, code_digest(*seeing.__path__), made_with])
