"""Poses between the steps of the stage, for what is sent at a rate of its own."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from studio.engine.base.quaternions import blended
from studio.engine.model.frames import StepResult

Array = NDArray[np.float64]

MOST_S = 0.1
"""Longest way from one step to the next; steps that are further apart are reached in this time."""


@dataclass(frozen=True)
class PoseAt:
    """A pose at an instant.

    Attributes:
        positions_m: output joints, stage frame [m], shape (52, 3).
        rotations_wxyz: their world rotations, shape (52, 4).
        root_height_m: as of `StepResult`.
        time_s: stage time [s].
    """

    positions_m: Array
    rotations_wxyz: Array
    root_height_m: float | None
    time_s: float


class PosesBetween:
    """Goes from where it is to the newest step, in the time that is between the last two.

    So it comes later than the steps by the time between two, and moves evenly at any rate.
    """

    def __init__(self) -> None:
        self._start: PoseAt | None = None
        self._goal: PoseAt | None = None
        self._begun_s = self._way_s = 0.0

    def add(self, step: StepResult, now_s: float) -> None:
        """Take in a step that came at a time [s]."""
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
        """Return the pose for a time [s]; a step has been added before."""
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
