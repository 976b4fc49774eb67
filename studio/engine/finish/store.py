"""What finishing needs of every step of a take, kept in a temporary file: memory stays small at any length."""

import tempfile
from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from studio.engine.errors import TakeError
from studio.engine.frames import FrameSet, FusedSkeleton, HandSeen, StepResult
from studio.engine.joints import JOINT_COUNT

BLOCK = 256
"""Steps that are written at once."""


class Store:
    """Steps of a pipeline in time order: `add` them all, then `read` any of them.

    Attributes:
        cameras: names of the cameras, in the order of the records.
        camera_positions: optical centres in the stage frame [m], shape (camera_count, 3).
    """

    def __init__(self, first: StepResult) -> None:
        """Begin with nothing; `first` tells how many cameras there are."""
        frames = first.frame_set
        self.cameras, self.camera_positions = frames.cameras, frames.camera_positions
        count = len(frames.cameras)
        assert first.configuration is not None
        self._dtype = np.dtype(
            [
                ("time_ns", "i8"),
                ("q", "f8", first.configuration.shape),
                ("positions", "f4", (count, JOINT_COUNT, 3)),
                ("confidence", "f4", (count, JOINT_COUNT)),
                ("used", "?", (count, JOINT_COUNT)),
                ("fused", "f4", (JOINT_COUNT, 3)),
                ("fused_confidence", "f4", (JOINT_COUNT,)),
                ("sigma", "f4", (JOINT_COUNT,)),
                ("head_wxyz", "f8", (4,)),
            ]
        )
        self._waiting = np.zeros(BLOCK, self._dtype)
        self._written = self._count = 0
        self._hands: dict[int, tuple[HandSeen, ...]] = {}  # by frame, where there are any
        self._file = tempfile.TemporaryFile(prefix="studio-finish-")

    def __len__(self) -> int:
        return self._count

    def add(self, result: StepResult) -> None:
        """Keep a step.

        Raises:
            TakeError: the disk of the temporary folder is full.
        """
        if self._count - self._written == BLOCK:
            self._write()
        frames, fused = result.frame_set, result.fused
        self._waiting[self._count - self._written] = (
            frames.stage_time_ns, result.configuration, frames.positions, frames.confidence, fused.used,
            fused.positions, fused.confidence, fused.sigma,
            np.nan if frames.head_wxyz is None else frames.head_wxyz,
        )  # fmt: skip
        if frames.hands:
            last = self._hands.get(self._count - 1)
            self._hands[self._count] = last if last == frames.hands else frames.hands
        self._count += 1

    def _write(self) -> None:
        try:
            self._waiting[: self._count - self._written].tofile(self._file)
        except OSError as error:
            raise TakeError(
                f"finishing keeps its frames in {tempfile.gettempdir()}, which does not take them: "
                f"{error.strerror}; free some space or set TMPDIR"
            ) from error
        self._written = self._count

    def read(self, begin: int, end: int) -> NDArray[np.void]:
        """Return the records of steps `begin` up to `end`, without it."""
        if self._written < self._count:
            self._write()
        self._file.seek(begin * self._dtype.itemsize)
        return np.fromfile(self._file, self._dtype, end - begin)

    def frames(self, begin: int, records: NDArray[np.void]) -> Iterable[tuple[FrameSet, FusedSkeleton]]:
        """Yield what was measured in each step of `records`, which begin at step `begin`."""
        for k, record in enumerate(records):
            head = record["head_wxyz"]
            w, x, y, z = (float(v) for v in head)
            yield (
                FrameSet(
                    int(record["time_ns"]),
                    self.cameras,
                    record["positions"].astype(np.float64),
                    record["confidence"].astype(np.float64),
                    self.camera_positions,
                    self._hands.get(begin + k, ()),
                    None if np.isnan(w) else (w, x, y, z),
                ),
                FusedSkeleton(
                    record["fused"].astype(np.float64),
                    record["fused_confidence"].astype(np.float64),
                    record["sigma"].astype(np.float64),
                    record["used"],
                ),
            )

    def close(self) -> None:
        """Delete the temporary file."""
        self._file.close()
