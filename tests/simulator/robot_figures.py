"""The table of docs/robots.md: `python -m tests.simulator.robot_figures MODEL.xml ... --clips FILE ... [--takes N]`.

Every robot follows the clips, and the solves of the first N clips as simulated cameras see them. Figures of each way
are means over the motions, weighted by their frames; shares of frames are those of all frames together.
"""

import argparse
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from time import thread_time

import numpy as np

from studio.__main__ import main as studio
from studio.commands.common import table
from studio.engine.animation.clip.options import ExportOptions
from studio.engine.animation.clip.resample import frames_of
from studio.engine.animation.read.imported import imported_poses
from studio.engine.model.poses import Poses
from studio.engine.robots.body.robot import Robot, build_robot
from studio.engine.robots.comparing import WAYS, compare_ways, ways_table
from studio.engine.robots.figures import FIGURES, RobotFigures
from studio.engine.robots.motion import part_of
from studio.engine.robots.moving.live import followed
from studio.take.folder.solved import solved_performers
from studio.take.folder.take import Take

_WORST = ("floor_penetration_mm", "self_penetration_mm", "torque_most")


def clip_poses(path: Path) -> Poses:
    """Return a clip's poses without its first frame, a T-pose that is not part of the motion."""
    poses, _ = imported_poses(path)
    return frames_of(poses, slice(1, None))


def solved_poses(path: Path, folder: Path) -> Poses:
    """Return the poses of a clip as the studio solves it from two simulated cameras."""
    take = folder / path.stem
    assert studio(["simulate", str(path), "--out", str(take)]) == 0
    assert studio(["calibrate", str(take)]) == 0
    assert studio(["solve", str(take), "--preset", "finish", "--name", "finish"]) == 0
    return solved_performers(Take.open(take), "finish")[0].poses


def motions(clips: Sequence[Path], takes: int) -> Iterator[tuple[str, Poses]]:
    """Yield the motions of the table by name."""
    for clip in clips:
        yield clip.stem, clip_poses(clip)
    with tempfile.TemporaryDirectory() as folder:
        for clip in clips[:takes]:
            yield f"{clip.stem} solved", solved_poses(clip, Path(folder))


def together(found: Sequence[Mapping[str, RobotFigures]]) -> dict[str, RobotFigures]:
    """Return the figures of each way over several motions."""
    return {way: _mean([figures[way] for figures in found]) for way in found[0]}


def _mean(figures: Sequence[RobotFigures]) -> RobotFigures:
    frames = np.array([one.frames for one in figures], dtype=float)
    out: dict[str, float | int | None] = {}
    for name in FIGURES:
        values = np.array([np.nan if getattr(one, name) is None else getattr(one, name) for one in figures])
        known = np.isfinite(values)
        if not known.any():
            out[name] = None
        elif name == "frames":
            out[name] = int(values.sum())
        elif name in _WORST:
            out[name] = float(values[known].max())
        elif name == "acceleration_rad_s2":
            out[name] = float(np.sqrt(np.average(values[known] ** 2, weights=frames[known])))
        else:
            out[name] = float(np.average(values[known], weights=frames[known]))
    return RobotFigures(**out)  # type: ignore[arg-type]


RUNS = 3
"""Number of live runs; a frame's shortest time counts, since longer times in other runs are not the frame's work."""


def live_ms(robot: Robot, poses: Poses) -> np.ndarray:
    """Return median, 99 % and largest processor time of the live way's frames, and that of the first frame [ms]."""
    motion = part_of(poses, ExportOptions())[1]
    took = np.min([followed(robot, motion, thread_time)[1] for _ in range(RUNS)], axis=0)
    return 1000.0 * np.array([*np.percentile(took[1:], [50, 99, 100]), took[0]])


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("models", nargs="+", type=Path)
    parser.add_argument("--clips", nargs="+", type=Path, required=True)
    parser.add_argument("--takes", type=int, default=0)
    parser.add_argument("--ways", nargs="+", choices=[*WAYS], default=[*WAYS])
    args = parser.parse_args()
    robots = [build_robot(model, model.stem) for model in args.models]
    found: dict[str, dict[str, dict[str, RobotFigures]]] = {robot.name: {} for robot in robots}
    for name, poses in motions(args.clips, args.takes):
        for robot in robots:
            found[robot.name][name] = ways = compare_ways(robot, poses, ways=args.ways)
            print(f"{robot.name}, {name}:\n{table(ways_table(ways))}", flush=True)
            print("live, median, 99 %, most, first ms:", np.round(live_ms(robot, poses), 2), flush=True)
    for robot, by_motion in found.items():
        for kind in (False, True):
            own = [ways for name, ways in by_motion.items() if name.endswith(" solved") == kind]
            if own:
                title = "solved takes" if kind else "clips"
                print(f"{robot}, {len(own)} {title}:\n{table(ways_table(together(own)))}")


if __name__ == "__main__":
    main()
