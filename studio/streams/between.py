"""Poses between the steps of the stage, for outputs with their own rate."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from studio.engine.base.quaternions import blended
from studio.engine.model.frames import StepResult

Array = NDArray[np.float64]

MOST_S = 0.1
"""Longest time to move from one step to the next, also for steps further apart."""


@dataclass(frozen=True)
class PoseAt:
    """A pose at an instant.

    Attributes:
        positions_m: output joints, stage frame [m], shape (52, 3).
        rotations_wxyz: their world rotations, shape (52, 4).
        root_height_m: as in `StepResult`.
        time_s: stage time [s].
    """

    positions_m: Array
    rotations_wxyz: Array
    root_height_m: float | None
    time_s: float


class PosesBetween:
    """Moves from the current pose to the newest step, over the time between the last two steps.

    So poses lag behind the steps by this time, and move evenly at any rate.
    """

    def __init__(self) -> None:
        self._start: PoseAt | None = None
        self._goal: PoseAt | None = None
        self._begun_s = self._way_s = 0.0

    def add(self, step: StepResult, now_s: float) -> None:
        """Add a step that arrived at a time [s]."""
        goal = PoseAt(
            step.positions_m,
            step.rotations_wxyz,
            step.root_height_m,
            step.frame_set.stage_time_ns * 1e-9,
        )
        if self._goal is not None:
            self._start, self._way_s = self.at(now_s), min(goal.time_s - self._goal.time_s, MOST_S)
        else:
            self._start = goal
        self._goal, self._begun_s = goal, now_s

    def at(self, now_s: float) -> PoseAt:
        """Return the pose for a time [s]; needs at least one added step."""
        start, goal = self._start, self._goal
        assert start is not None and goal is not None
        gone_s = now_s - self._begun_s
        share = gone_s / self._way_s if gone_s < self._way_s else 1.0
        if share == 1.0:
            return goal
        return PoseAt(
            (1.0 - share) * start.positions_m + share * goal.positions_m,
            blended(start.rotations_wxyz, goal.rotations_wxyz, share),
            goal.root_height_m,
            (1.0 - share) * start.time_s + share * goal.time_s,
        )
