"""Motions of robots by the performers of a solve, kept next to its poses.

Next to each motion, a JSON file lists the joints that need too much torque, and the times when the motion gave way
for that. A file's name holds a digest of the robot's table, of the poses, and of the retargeting code; it changes
with any of them.
"""

import json
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import asdict, dataclass, replace
from hashlib import sha256
from pathlib import Path

from studio.engine import robots as robots_code
from studio.engine import whole_take
from studio.engine.base.errors import FormatError
from studio.engine.base.files import code_digest, write_json
from studio.engine.robots.body.robot import Robot
from studio.engine.robots.files import load_robot, robot_table
from studio.engine.robots.motion import RobotMotion, load_motion, moved_robot
from studio.engine.robots.moving.gave_way import GaveWay
from studio.engine.robots.strain import StrainedJoint, strain_of
from studio.take.folder.performers import performer_number
from studio.take.folder.solved import solved_performers
from studio.take.folder.take import POSES, Take

_DIGITS = 12


def keep_robot_motions(
    take: Take, solve: str, robots: Path, name: str, *, progress: Callable[[float], None] = lambda share: None
) -> None:
    """Retarget the performers of a solve to a kept robot, as a whole take, and keep the motions next to their poses.

    Args:
        take: of the solve.
        solve: its name.
        robots: folder of the kept robots.
        name: of the robot.
        progress: receives the share done.

    Raises:
        FormatError: as `load_robot` and `moved_robot`.
    """
    robot = load_robot(robots, name)
    performers = solved_performers(take, solve)
    files = [file for _, file in _files(take, solve, robots, name)]
    for k, (one, file) in enumerate(zip(performers, files, strict=True)):

        def tell(share: float, done: int = k) -> None:
            progress((done + share) / len(performers))

        motion, _ = moved_robot(robot, one.poses, progress=tell)
        for old in file.parent.glob(f"robot_{name}_{'?' * _DIGITS}.*"):
            old.unlink(missing_ok=True)
        told = {"strained": strain_of(robot, motion), "gave_way": motion.gave_way}
        write_json(
            file.with_suffix(".json"), {key: [asdict(one) for one in value] for key, value in told.items()}
        )
        motion.save(file)


@dataclass(frozen=True)
class KeptMotion:
    """A kept motion, and the joints that need too much torque in it."""

    motion: RobotMotion
    strained: tuple[StrainedJoint, ...]


def kept_robot_motions(take: Take, solve: str, robots: Path, robot: Robot) -> dict[int, KeptMotion] | None:
    """Return the kept motions of a robot by the performer's number; None where one is missing, damaged, or of other
    poses or other code."""
    out = {}
    for number, file in _files(take, solve, robots, robot.name):
        if not file.is_file():
            return None
        try:
            strained, times = _told(file.with_suffix(".json"))
            out[number] = KeptMotion(replace(load_motion(file, robot), gave_way=times), strained)
        except FormatError:  # a damaged file is made again
            return None
    return out


def _told(path: Path) -> tuple[tuple[StrainedJoint, ...], tuple[GaveWay, ...]]:
    """Return a motion's strained joints, and when it gave way; empty where the file is missing or damaged."""
    with suppress(OSError, ValueError, TypeError, KeyError):
        told = json.loads(path.read_text(encoding="utf-8"))
        return (
            tuple(StrainedJoint(**one) for one in told["strained"]),
            tuple(GaveWay(**one) for one in told["gave_way"]),
        )
    return (), ()


def _files(take: Take, solve: str, robots: Path, name: str) -> Iterator[tuple[int, Path]]:
    """Yield the number and the file of each performer's motion."""
    code = code_digest(*robots_code.__path__, *whole_take.__path__)
    made_with = robot_table(robots, name).read_bytes() + code.encode()
    for performer in take.performer_names(solve) or [""]:
        folder = take.performer_folder(solve, performer) if performer else take.solve_folder(solve)
        digest = sha256(made_with)
        digest.update((folder / POSES).read_bytes())
        file = folder / f"robot_{name}_{digest.hexdigest()[:_DIGITS]}.npz"
        yield performer_number(performer) if performer else 1, file
