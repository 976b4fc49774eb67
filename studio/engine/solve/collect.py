"""Poses of a take as they come: what is long goes to a temporary file, so that memory stays small at any length."""

import tempfile
from collections.abc import Iterable
from typing import IO

import numpy as np
from numpy.typing import NDArray

from studio.engine.errors import TakeError
from studio.engine.frames import StepResult
from studio.engine.joints import OUTPUT_JOINTS, OUTPUT_PARENTS
from studio.engine.poses import Poses

BLOCK = 4096
"""Frames that are kept in memory before they are written; a shorter take needs no file."""

_SHAPES = {
    "positions_m": (len(OUTPUT_JOINTS), 3),
    "rotations_wxyz": (len(OUTPUT_JOINTS), 4),
    "confidence": (len(OUTPUT_JOINTS),),
    "uncertainty_mm": (len(OUTPUT_JOINTS),),
}


class PoseCollector:
    """Takes in steps' results in time order; gives them as `Poses`."""

    def __init__(self) -> None:
        self._times_ns: list[int] = []
        self._rows: dict[str, list[NDArray[np.float64]]] = {key: [] for key in _SHAPES}
        self._files: dict[str, IO[bytes]] = {}

    def add(self, result: StepResult) -> None:
        """Take in a result.

        Raises:
            TakeError: the disk of the temporary folder is full.
        """
        self._times_ns.append(result.frame_set.stage_time_ns)
        for key, rows in self._rows.items():
            rows.append(getattr(result, key))
            if len(rows) == BLOCK:
                self._write(key)

    def _write(self, key: str) -> None:
        if key not in self._files:
            self._files[key] = tempfile.TemporaryFile(prefix="studio-poses-")
        try:
            np.array(self._rows[key]).tofile(self._files[key])
        except OSError as error:
            raise TakeError(
                f"poses are collected in {tempfile.gettempdir()}, which does not take them: {error.strerror}; "
                "free some space or set TMPDIR"
            ) from error
        self._rows[key].clear()

    def poses(self) -> Poses:
        """Return what was added; long arrays are mapped from their file.

        Raises:
            TakeError: nothing was.
        """
        if not self._times_ns:
            raise TakeError(
                "no camera shows the performer in this take; check the cameras and `--set cameras=...`"
            )
        arrays = {key: self._array(key) for key in _SHAPES}
        return Poses(
            time_s=np.array(self._times_ns) * 1e-9,
            joint_names=OUTPUT_JOINTS,
            parents=OUTPUT_PARENTS.copy(),
            **arrays,
        )

    def _array(self, key: str) -> NDArray[np.float64]:
        if key not in self._files:
            return np.array(self._rows[key])
        if self._rows[key]:
            self._write(key)
        shape = (len(self._times_ns), *_SHAPES[key])
        with self._files.pop(key) as file:  # the mapping keeps what the file held
            file.flush()
            return np.memmap(file, np.float64, "c", shape=shape)


def collect_poses(results: Iterable[StepResult]) -> Poses:
    """Return steps' results, in time order, as `Poses`.

    Raises:
        TakeError: there is none.
    """
    collector = PoseCollector()
    for result in results:
        collector.add(result)
    return collector.poses()
