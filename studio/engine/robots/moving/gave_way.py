"""Intervals in which a robot's motion left its targets to limit torques: when, which point, and how far."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from studio.engine.base.arrays import runs
from studio.engine.robots.body.robot import INDEX
from studio.engine.robots.moving.targets import KEY_POINTS

Array = NDArray[np.float64]

TOLD_M = 0.03
"""Deviations up to this are not reported [m]."""

APART_S = 0.2
"""Intervals closer together than this are merged [s]."""


@dataclass(frozen=True)
class GaveWay:
    """An interval in which a motion gave way.

    Attributes:
        begin_s, end_s: since the performance began [s].
        most_m: largest distance of a key point from where it would be without torque limits [m].
        point: that point.
    """

    begin_s: float
    end_s: float
    most_m: float
    point: str


def gave_way(before_m: Array, after_m: Array, frame_s: float) -> tuple[GaveWay, ...]:
    """Return the intervals in which a motion gave way, timed from its first frame.

    Args:
        before_m: the robot's points without torque limits, shape (frame_count, point_count, 3).
        after_m: its points in the motion, same shape.
        frame_s: time between frames [s].
    """
    points = [INDEX[point] for point in KEY_POINTS]
    way = np.linalg.norm(after_m[:, points] - before_m[:, points], axis=2)
    told: list[GaveWay] = []
    for begin, end in runs(way.max(axis=1) > TOLD_M):
        most = way[begin:end]
        point = KEY_POINTS[int(most.max(axis=0).argmax())]
        one = GaveWay(begin * frame_s, (end - 1) * frame_s, float(most.max()), point)
        if told and one.begin_s - told[-1].end_s < APART_S:
            worse = max(told[-1], one, key=lambda time: time.most_m)
            one = replace(worse, begin_s=told.pop().begin_s, end_s=one.end_s)
        told.append(one)
    return tuple(told)


def gave_way_text(times: Sequence[GaveWay], begin_s: float = 0.0) -> str:
    """Return the intervals as text; `begin_s`: time of the first frame since the performance began [s]."""
    told = [
        f"{one.begin_s + begin_s:.2f} to {one.end_s + begin_s:.2f} s by up to "
        f"{100.0 * one.most_m:.0f} cm ({one.point})"
        for one in times
    ]
    return "gave way in pose for its torques: " + ("; ".join(told) or "never")
