"""Inputs of a solve, frame by frame (`trace.npz`): the cameras' joints, the fused ones, the cameras used.

The replay shows them next to the poses. Positions are stored in half millimetres, so that an hour stays small.
"""

import os
from dataclasses import dataclass, replace
from typing import Any
from zipfile import BadZipFile

import numpy as np
from numpy.typing import NDArray

from studio.engine.base.arrays import read_arrays, save_arrays
from studio.engine.base.errors import FormatError
from studio.engine.base.files import write_atomically
from studio.engine.base.records import Records
from studio.engine.base.versions import TRACE
from studio.engine.model.frames import FrameSet, FusedSkeleton, StepResult
from studio.engine.model.joints import JOINT_COUNT

STEP_M = 0.0005
_UNSEEN = np.iinfo(np.int16).min
_KEYS = ("time_ns", "cameras", "reasons", "camera_half_mm", "fused_half_mm", "confidence", "used", "reason")


def _packed(positions: NDArray[np.float64]) -> NDArray[np.int16]:
    steps = np.clip(np.nan_to_num(positions / STEP_M, nan=_UNSEEN), _UNSEEN, -_UNSEEN - 1)
    return np.rint(steps).astype(np.int16)


def _unpacked(steps: NDArray[np.int16]) -> NDArray[np.float64]:
    return np.where(steps == _UNSEEN, np.nan, steps * STEP_M)


@dataclass(frozen=True)
class Trace:
    """A solve's inputs over time.

    Attributes:
        time_ns: stage time of each frame [ns], shape (frame_count,).
        cameras: names, shape (camera_count,).
        reasons: why a camera's joint was not used; the first is empty.
        camera_half_mm: cameras' joints in the stage frame [0.5 mm], shape (frame_count, camera_count, 21, 3).
        fused_half_mm: fused joints, shape (frame_count, 21, 3).
        confidence: of the fused joints in 1/255, shape (frame_count, 21).
        used: whether a camera's joint was used, shape (frame_count, camera_count, 21).
        reason: index into `reasons`, shape (frame_count, camera_count, 21).
    """

    time_ns: NDArray[np.int64]
    cameras: tuple[str, ...]
    reasons: tuple[str, ...]
    camera_half_mm: NDArray[np.int16]
    fused_half_mm: NDArray[np.int16]
    confidence: NDArray[np.uint8]
    used: NDArray[np.bool_]
    reason: NDArray[np.uint8]

    def inputs(self, frame: int) -> tuple[FrameSet, FusedSkeleton]:
        """Return the inputs of a frame of the solve; camera positions and uncertainties are not stored."""
        seen = _unpacked(self.camera_half_mm[frame])
        confidence = np.isfinite(seen[..., 0]).astype(np.float64)
        none = np.full((len(self.cameras), 3), np.nan)
        frames = FrameSet(int(self.time_ns[frame]), self.cameras, seen, confidence, none)
        sure = self.confidence[frame] / 255.0
        fused = _unpacked(self.fused_half_mm[frame])
        return frames, FusedSkeleton(fused, sure, np.full(JOINT_COUNT, np.nan), self.used[frame])

    def seen(self, rows: NDArray[np.int64]) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
        """Return the cameras' joints in some frames [m], shape (row_count, camera_count, 21, 3), and which of them
        were used."""
        return _unpacked(self.camera_half_mm[rows]), self.used[rows]

    def part(self, rows: "slice | NDArray[np.int64]") -> "Trace":
        """Return some of the frames."""
        keys = ("time_ns", "camera_half_mm", "fused_half_mm", "confidence", "used", "reason")
        return replace(self, **{key: getattr(self, key)[rows] for key in keys})

    def padded(self, before_ns: NDArray[np.int64], after_ns: NDArray[np.int64]) -> "Trace":
        """Return the trace with frames at these times before and after it, in which no camera sees anybody."""

        def wider(values: NDArray[Any], fill: int) -> NDArray[Any]:
            first, last = (
                np.full((len(times), *values.shape[1:]), fill, values.dtype)
                for times in (before_ns, after_ns)
            )
            return np.concatenate([first, values, last])

        return replace(
            self,
            time_ns=np.concatenate([before_ns, self.time_ns, after_ns]),
            camera_half_mm=wider(self.camera_half_mm, _UNSEEN),
            fused_half_mm=wider(self.fused_half_mm, _UNSEEN),
            confidence=wider(self.confidence, 0),
            used=wider(self.used, 0),
            reason=wider(self.reason, 0),
        )

    def save(self, path: str | os.PathLike[str], *, to_disk: bool = True) -> None:
        """Write the trace, atomically; `to_disk`: see `files.write_atomically`.

        Raises:
            StudioError: the file cannot be written.
        """
        with write_atomically(path, to_disk=to_disk) as file:
            save_arrays(file, {key: getattr(self, key) for key in _KEYS}, TRACE)

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> "Trace":
        """Return the trace in a file.

        Raises:
            FormatError: the file is missing or damaged.
        """
        try:
            values = read_arrays(path, _KEYS, TRACE)
        except (OSError, ValueError, KeyError, EOFError, MemoryError, BadZipFile) as error:
            raise FormatError(
                "trace.damaged",
                "{path} is no trace of a solve ({error}); solve the take again",
                path=path,
                error=error,
            ) from error
        texts = {key: tuple(str(text) for text in values[key]) for key in ("cameras", "reasons")}
        fields: dict[str, Any] = {**values, **texts}
        return cls(**fields)


class TraceCollector:
    """Collects step results in time order and returns them as a `Trace`. The first gives the cameras."""

    def __init__(self) -> None:
        self._cameras: tuple[str, ...] = ()
        self._reasons: dict[str, int] = {"": 0}
        self._records: Records | None = None

    def add(self, result: StepResult) -> None:
        """Add a result.

        Raises:
            TakeError: the disk of the temporary folder is full.
        """
        frames, fused = result.frame_set, result.fused
        if self._records is None:
            self._cameras = frames.cameras
            self._records = Records(self._dtype())
        row = np.zeros((), self._records.dtype)
        row["time_ns"] = frames.stage_time_ns
        row["fused_half_mm"] = _packed(fused.positions)
        row["confidence"] = np.rint(255.0 * np.clip(np.nan_to_num(fused.confidence), 0.0, 1.0))
        row["camera_half_mm"] = _UNSEEN
        places = {
            i: self._cameras.index(name) for i, name in enumerate(frames.cameras) if name in self._cameras
        }
        for i, place in places.items():
            row["camera_half_mm"][place] = _packed(frames.positions[i])
            row["used"][place] = fused.used[i]
        for (i, joint), reason in fused.reasons.items():
            if i in places:
                row["reason"][places[i], joint] = self._reasons.setdefault(
                    reason, min(len(self._reasons), 255)
                )
        self._records.add(row[()])

    def _dtype(self) -> np.dtype[np.void]:
        count = len(self._cameras)
        return np.dtype(
            [
                ("time_ns", "i8"),
                ("camera_half_mm", "i2", (count, JOINT_COUNT, 3)),
                ("fused_half_mm", "i2", (JOINT_COUNT, 3)),
                ("confidence", "u1", (JOINT_COUNT,)),
                ("used", "?", (count, JOINT_COUNT)),
                ("reason", "u1", (count, JOINT_COUNT)),
            ]
        )

    def trace(self) -> Trace:
        """Return the collected trace.

        Raises:
            FormatError: no result was added.
        """
        if self._records is None:
            raise FormatError("trace.no_frames", "a solve without frames has no trace")
        rows = self._records.all()
        columns = {name: rows[name] for name in rows.dtype.names or ()}
        return Trace(cameras=self._cameras, reasons=tuple(self._reasons), **columns)
