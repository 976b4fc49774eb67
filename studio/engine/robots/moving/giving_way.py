"""Torques of a robot's motion brought within their limits; the motion gives way for them.

Parts of a take with torques beyond their limits are solved again, each with some time around it (`strained_part`).
Parts that remain after a pass are solved again in the next, and may give way further.
"""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from studio.engine.base.arrays import runs
from studio.engine.robots.body.robot import Robot
from studio.engine.robots.moving.solver import FIRM_ITERATION, RobotSolver, apart_m
from studio.engine.robots.moving.strained_part import HELD, NearFrames, StrainedPart
from studio.engine.robots.moving.targets import Targets
from studio.engine.robots.moving.torque_rows import LinearTorques
from studio.engine.robots.moving.torques import RobotTorques, Strain

Array = NDArray[np.float64]

PASSES = ((0.4, 14), (0.4, 14), (0.4, 20), (0.4, 20), (1.0, 30))
"""Time before and after torques beyond limits that is solved again [s], and maximum number of steps, of each pass.
Most torques need few steps; the remaining parts are shorter."""

GIVES_WAY, STANDS_UP = 1, 2
"""First pass in which the motion gives way, and the pass that first brings the centre of mass over the soles."""

LONGEST, CALM_S = 360, 0.1
"""Maximum number of frames solved at once; a longer part is cut where torques over this time [s] are least."""

ROUNDING = 1e-9


class GivingWay:
    """Brings a robot's motions within its torques' limits."""

    def __init__(self, robot: Robot, solver: RobotSolver, frame_s: float, *, gives_way: bool) -> None:
        """Args: `gives_way`: the pose may change too, not only its accelerations."""
        self._robot, self._solver, self._gives_way = robot, solver, gives_way
        self._torques = RobotTorques(robot, frame_s)
        self._linear = LinearTorques(robot, solver.kinematics.dofs, frame_s)
        self._around = NearFrames(frame_s)

    def kept(self, q: Array, targets: Targets, apart: bool, progress: Callable[[float], None]) -> Array:
        """Return configurations, shape (frame_count, 7 + active), with torques within or nearer to their limits."""
        if not self._torques.given or len(q) < 2 * HELD + 1:
            return q
        q = q.copy()
        weight, ease = np.ones(len(q) - 2), np.ones(len(q))
        sigma_m = apart_m(FIRM_ITERATION) if apart else None
        for done, (around_s, count) in enumerate(PASSES if self._can_stand() else PASSES[:1]):
            for begin, end in self._parts(self._strain(q).shares.max(axis=1), around_s):
                rows = slice(begin, end)
                part = StrainedPart(
                    self._solver,
                    self._strain,
                    self._linear,
                    targets.part(rows),
                    q[rows],
                    held=_held(begin > 0, end < len(q), end - begin),
                    weight=weight[begin : end - 2],
                    ease=ease[rows],
                    apart_m=sigma_m,
                )
                if self._gives_way and done == STANDS_UP:
                    part.stand_up()
                part.approach(count, gives_way=self._gives_way and done >= GIVES_WAY)
                part.mend()
                part.come_back()
                q[rows], weight[begin : end - 2], ease[rows] = part.q, part.weight, part.ease
                progress((done + end / len(q)) / len(PASSES))
        return q

    def _strain(self, q: Array) -> Strain:
        """The load of the hinges in the finished motion."""
        return self._torques.strain(self._solver.finished(q))

    def _can_stand(self) -> bool:
        """Whether the robot's limits let it stand; otherwise giving way cannot bring torques within them."""
        standing = np.tile(self._solver.kinematics.reduced(self._robot.standing[None]), (3, 1))
        return float(self._strain(standing).shares.max()) <= 1.0

    def _parts(self, most: Array, around_s: float) -> list[tuple[int, int]]:
        """First frame, and one after the last, of parts around frames with torques beyond their limits."""
        near = self._around(most > 1.0, around_s) > ROUNDING
        calm = self._around(most, CALM_S)
        parts = []
        for begin, end in runs(near):
            while end - begin > LONGEST:
                cut = begin + LONGEST // 2 + int(calm[begin + LONGEST // 2 : begin + LONGEST].argmin())
                parts.append((begin, cut))
                begin = cut
            parts.append((begin, end))
        return [(max(begin - HELD, 0), min(end + HELD, len(near))) for begin, end in parts]


def _held(before: bool, after: bool, frames: int) -> NDArray[np.int64]:
    """Fixed frames at the ends of a part that has frames before or after it."""
    first, last = np.arange(HELD if before else 0), frames - 1 - np.arange(HELD if after else 0)
    return np.concatenate([first, last])
