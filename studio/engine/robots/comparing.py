"""The ways of moving a robot, side by side, on one motion."""

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from studio.engine.animation.clip.options import ExportOptions
from studio.engine.model.poses import Poses
from studio.engine.robots.body.robot import Robot
from studio.engine.robots.figures import FIGURES, RobotFigures, robot_figures
from studio.engine.robots.motion import part_of
from studio.engine.robots.moving.live import followed
from studio.engine.robots.moving.per_frame import PerFrame, part_turns
from studio.engine.robots.moving.performed import Performed
from studio.engine.robots.moving.solver import Retargeting
from studio.engine.robots.moving.targets import Targets, targets_of
from studio.engine.robots.moving.whole_take import retargeted

WAYS: dict[str, Callable[[Robot, Performed, Targets], NDArray[np.float64]]] = {
    "whole take": lambda robot, motion, targets: retargeted(robot, targets),
    "with balance": lambda robot, motion, targets: retargeted(robot, targets, Retargeting(balance=True)),
    "live": lambda robot, motion, targets: followed(robot, motion)[0],
    "per frame": lambda robot, motion, targets: PerFrame(robot).solve(
        targets, part_turns(robot, motion, targets)
    ),
}
"""Way of moving a robot -> its configurations; `per frame` is the baseline."""

_DIGITS = {
    "foot_slide_cm_s": ("slide of standing feet cm/s", 2), "floating_mm": ("height of standing feet mm", 1),
    "floor_penetration_share": ("frames > 5 mm in the floor", 4),
    "floor_penetration_mm": ("deepest in the floor mm", 1),
    "self_penetration_share": ("frames > 5 mm in itself", 4), "self_penetration_mm": ("deepest in itself mm", 1),
    "limit_share": ("frames beyond limits", 4), "velocity_share": ("steps too fast", 4),
    "acceleration_rad_s2": ("joint acceleration RMS rad/s2", 1),
    "torque_share": ("frames too strong", 4), "torque_most": ("largest torque, of its limit", 2),
    "key_point_mm": ("key points off mm", 1),
    "balance_share": ("standing frames in balance", 3), "frames": ("frames", 0),
}  # fmt: skip


def compare_ways(
    robot: Robot,
    poses: Poses,
    options: ExportOptions | None = None,
    *,
    ways: Sequence[str] = tuple(WAYS),
    progress: Callable[[float], None] = lambda share: None,
) -> dict[str, RobotFigures]:
    """Return the figures of each way of moving a robot by the same poses.

    Raises:
        SettingsError, FormatError: as `motion.moved_robot`.
    """
    _, motion = part_of(poses, options or ExportOptions())
    targets, found = targets_of(robot, motion), {}
    for k, way in enumerate(ways):
        found[way] = robot_figures(robot, WAYS[way](robot, motion, targets), targets)
        progress((k + 1) / len(ways))
    return found


def ways_table(ways: dict[str, RobotFigures]) -> list[list[str]]:
    """Return the figures as rows of a table, one column per way."""
    rows = [["", *ways]]
    for name in FIGURES:
        title, digits = _DIGITS[name]
        values = [getattr(figures, name) for figures in ways.values()]
        rows.append([title, *("-" if value is None else f"{value:.{digits}f}" for value in values)])
    return rows
