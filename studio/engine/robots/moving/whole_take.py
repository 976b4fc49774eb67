"""Retargeting of a whole take: all frames of a robot's motion at once.

Minimises, over all frames, the distances of the robot's points from their targets, the accelerations of its joints,
and violations of limits (`solver`). The method is that of `whole_take.finish.smoother`: Gauss-Newton on a banded
problem. Parts that need too much torque give way afterwards (`giving_way`).
"""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

import studio.engine.base.blas  # noqa: F401, so that equal input gives equal bits
from studio.engine.robots.body.robot import Robot
from studio.engine.robots.moving.gave_way import GaveWay, gave_way
from studio.engine.robots.moving.giving_way import GivingWay
from studio.engine.robots.moving.solver import Retargeting, RobotSolver, apart_m
from studio.engine.robots.moving.targets import Targets, replanted

Array = NDArray[np.float64]

WINDOW, MARGIN, JOINED = 1500, 120, 2
"""Frames solved at once, frames after them that are solved again with the next window, and fixed frames before a
window."""

ITERATIONS = 32
"""Gauss-Newton steps."""

REPLANTED = (8, 13, 18)
"""Steps before which stances move to where the robot's feet are."""

FOLLOWING = 0.7
"""Share of the progress at which the solve of torques begins."""


def retargeted(
    robot: Robot,
    targets: Targets,
    options: Retargeting | None = None,
    *,
    progress: Callable[[float], None] = lambda share: None,
) -> Array:
    """Return a robot's configurations, as `retargeted_and_told` does."""
    return retargeted_and_told(robot, targets, options, progress=progress)[0]


def retargeted_and_told(
    robot: Robot,
    targets: Targets,
    options: Retargeting | None = None,
    *,
    progress: Callable[[float], None] = lambda share: None,
) -> tuple[Array, tuple[GaveWay, ...]]:
    """Return a robot's configurations, and the intervals in which they give way for its torques.

    Returns:
        Configurations, shape (frame_count, nq), in MuJoCo's order; quaternions wxyz. Every hinge stays within its
        limits of angle and velocity. Intervals are timed from the first frame.
    """
    options = options or Retargeting()
    solver = RobotSolver(robot, targets, options)
    q = solver.start(targets)
    for begin in range(0, len(q), WINDOW):
        low, high = max(begin - JOINED, 0), min(begin + WINDOW + MARGIN, len(q))
        if low > 0 and high - begin <= MARGIN:  # solved with the window before
            break
        rows = slice(low, high)
        for iteration in range(ITERATIONS):
            if iteration in REPLANTED:
                targets = replanted(robot, targets, solver.points(q[rows]), rows)
            apart = apart_m(iteration) if options.self_contact else None
            q[rows] = solver.stepped(q[rows], targets.part(rows), begin - low, apart=apart)
            progress(FOLLOWING * (begin + (high - begin) * (iteration + 1) / ITERATIONS) / len(q))
    told: tuple[GaveWay, ...] = ()
    if options.strength:
        before = solver.points(q)
        way = GivingWay(robot, solver, targets.frame_s, gives_way=options.give_way)
        q = way.kept(
            q, targets, options.self_contact, lambda share: progress(FOLLOWING + (1.0 - FOLLOWING) * share)
        )
        told = gave_way(before, solver.points(q), targets.frame_s)
    progress(1.0)
    return solver.finished(q), told
