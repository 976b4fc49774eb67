"""Export of a kept robot's motion as it follows the performers of a solve."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from studio.engine.animation.clip.options import ExportOptions
from studio.engine.robots.files import load_robot
from studio.engine.robots.motion import check_format, moved_robot, write_motion
from studio.engine.robots.moving.gave_way import gave_way_text
from studio.engine.robots.moving.solver import Retargeting
from studio.engine.robots.strain import strain_of, strain_text
from studio.take.folder.solved import solved_performers
from studio.take.folder.take import Take
from studio.take.library.exports.solve_export import archive_of, named_file


@dataclass(frozen=True)
class RobotFile:
    """A robot's motion that was written, and lines on its torques; no lines if its model has no limits."""

    path: Path
    frame_count: int
    frames_per_second: float
    told: tuple[str, ...]


def export_robot(
    take: Take,
    solve: str,
    robots: Path,
    robot: str,
    out: Path,
    format: str,
    options: ExportOptions | None = None,
    *,
    balance: bool = False,
    give_way: bool = True,
    performer: str | None = None,
    archive: Path | None = None,
    progress: Callable[[float], None] | None = None,
) -> list[RobotFile]:
    """Write a robot's motion by each performer of a solve; return the files.

    Args:
        take, solve: whose performers.
        robots: folder of the kept robots.
        robot: name of one of them.
        out: the file; with several performers, each file has their name added.
        format: `csv` or `npz`.
        options: part, rate and smoothing.
        balance, give_way: see `Retargeting`.
        performer: only this one of several, in `out` itself; None = all.
        archive: a ZIP that also receives the files; None = none.
        progress: receives the share done.

    Raises:
        SettingsError: a format or options that are not allowed.
        FormatError: no such robot, or poses that it cannot follow.
        TakeError: nobody has this name.
        StudioError: a file cannot be written.
    """
    check_format(format)
    model = load_robot(robots, robot)
    performers = solved_performers(take, solve, performer)
    told, found = progress or (lambda share: None), list[RobotFile]()
    how = Retargeting(balance=balance, give_way=give_way)
    for k, one in enumerate(performers):

        def part(share: float, before: int = k) -> None:
            told((before + share) / len(performers))

        motion, _ = moved_robot(model, one.poses, options, how, progress=part)
        path = out if performer is not None else named_file(out, one.name)
        write_motion(motion, path, format)
        lines: tuple[str, ...] = ()
        if np.isfinite(model.torque_nm).any():
            begins_s = motion.time_s[0] if one.poses.begins_s is None else one.poses.begins_s
            lines = (
                strain_text(strain_of(model, motion, begins_s)),
                gave_way_text(motion.gave_way, motion.time_s[0] - begins_s),
            )
        found.append(RobotFile(path, len(motion.time_s), motion.frames_per_second, lines))
    if archive is not None:
        archive_of([(one.path, one.path.name) for one in found], archive)
    return found
