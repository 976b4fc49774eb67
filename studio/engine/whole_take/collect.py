"""Poses of a take, collected step by step. Long takes go to a temporary file, so that memory does not grow."""

from collections.abc import Iterable

import numpy as np

from studio.engine.base.errors import TakeError
from studio.engine.base.records import Records
from studio.engine.model.frames import StepResult
from studio.engine.model.joints import OUTPUT_JOINTS, OUTPUT_PARENTS
from studio.engine.model.poses import Poses

_SHAPES = {
    "positions_m": (len(OUTPUT_JOINTS), 3),
    "rotations_wxyz": (len(OUTPUT_JOINTS), 4),
    "confidence": (len(OUTPUT_JOINTS),),
    "uncertainty_mm": (len(OUTPUT_JOINTS),),
}


class PoseCollector:
    """Collects step results in time order and returns them as `Poses`."""

    def __init__(self) -> None:
        self._times_ns: list[int] = []
        self._root_height_m: float | None = None
        self._records = {key: Records(np.dtype((np.float64, shape))) for key, shape in _SHAPES.items()}

    def add(self, result: StepResult) -> None:
        """Add a result.

        Raises:
            TakeError: the disk of the temporary folder is full.
        """
        self._times_ns.append(result.frame_set.stage_time_ns)
        self._root_height_m = result.root_height_m
        for key, records in self._records.items():
            records.add(getattr(result, key))

    def poses(self) -> Poses:
        """Return the collected poses; long arrays are mapped from their file.

        Raises:
            TakeError: no result was added.
        """
        if not self._times_ns:
            raise TakeError(
                "take.nobody_seen",
                "no camera shows the performer in this take; check the cameras and `--set cameras=...`",
            )
        return Poses(
            time_s=np.array(self._times_ns) * 1e-9,
            joint_names=OUTPUT_JOINTS,
            parents=OUTPUT_PARENTS.copy(),
            root_height_m=self._root_height_m,
            **{key: records.all() for key, records in self._records.items()},
        )


def collect_poses(results: Iterable[StepResult]) -> Poses:
    """Return step results, in time order, as `Poses`.

    Raises:
        TakeError: there is none.
    """
    collector = PoseCollector()
    for result in results:
        collector.add(result)
    return collector.poses()
