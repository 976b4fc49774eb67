"""Motions of robots, and their files: CSV for other tools, npz with everything."""

import os
import zipfile
import zlib
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from studio.engine.animation.clip.clip import prepared_poses
from studio.engine.animation.clip.options import MAX_FPS, ExportOptions, check_options
from studio.engine.animation.clip.resample import resampled
from studio.engine.base.arrays import read_arrays, save_arrays
from studio.engine.base.errors import FormatError, SettingsError
from studio.engine.base.files import write_atomically
from studio.engine.base.quaternions import continuous_signs
from studio.engine.base.versions import ROBOT_MOTION
from studio.engine.model.poses import Poses
from studio.engine.robots.body.robot import Robot
from studio.engine.robots.free_joint import FREE
from studio.engine.robots.moving.gave_way import GaveWay
from studio.engine.robots.moving.performed import Performed, performed
from studio.engine.robots.moving.solver import Retargeting
from studio.engine.robots.moving.targets import Targets, targets_of
from studio.engine.robots.moving.whole_take import retargeted_and_told

Array = NDArray[np.float64]

_KEYS = ("time_s", "qpos", "joint_names", "robot")


@dataclass(frozen=True)
class RobotMotion:
    """A robot's motion on a uniform clock.

    Attributes:
        robot: its name.
        joint_names: hinges in the model's order.
        time_s: stage time of each frame [s], shape (frame_count,).
        qpos: MuJoCo's configurations: base [m], quaternion wxyz, hinges [rad], shape (frame_count, 7 + hinge_count).
        gave_way: intervals in which it gave way in pose for its torques, since the first frame; not saved in files.
    """

    robot: str
    joint_names: tuple[str, ...]
    time_s: Array
    qpos: Array
    gave_way: tuple[GaveWay, ...] = ()

    @property
    def frames_per_second(self) -> float:
        """Frame rate [Hz]; 60 for a single frame."""
        return (
            60.0
            if len(self.time_s) < 2
            else float((len(self.time_s) - 1) / (self.time_s[-1] - self.time_s[0]))
        )

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the motion as npz, atomically."""
        arrays = {
            "time_s": self.time_s,
            "qpos": self.qpos,
            "joint_names": np.array(self.joint_names),
            "robot": np.array(self.robot),
        }
        with write_atomically(path) as file:
            save_arrays(file, arrays, ROBOT_MOTION)

    def save_csv(self, path: str | os.PathLike[str]) -> None:
        """Write one row per frame, atomically: base x, y, z [m], quaternion x, y, z, w, hinges [rad]; no header."""
        q = self.qpos
        rows = np.concatenate([q[:, :3], q[:, 4:7], q[:, 3:4], q[:, FREE:]], axis=1)
        with write_atomically(path) as file:
            np.savetxt(file, rows, fmt="%.6f", delimiter=",")


FORMATS: dict[str, Callable[[RobotMotion, str | os.PathLike[str]], None]] = {
    "csv": RobotMotion.save_csv,
    "npz": RobotMotion.save,
}
"""Format -> its writer."""


CSV_FPS = 30.0
"""Assumed rate of a CSV, which states none: that of the LAFAN1 retargeting set."""


def load_motion(path: str | os.PathLike[str], robot: Robot, csv_fps: float = CSV_FPS) -> RobotMotion:
    """Return a robot's motion from npz, or from CSV, which states no rate, at `csv_fps` frames per second.

    Raises:
        SettingsError: a rate that is not allowed.
        FormatError: the file cannot be read, or belongs to another robot.
    """
    if not 0.0 < csv_fps <= MAX_FPS:  # NaN fails too
        raise SettingsError(
            "export.between",
            "{name}={value}: allowed is a number above {low:g} and up to {high:g}",
            name="fps",
            value=csv_fps,
            low=0.0,
            high=MAX_FPS,
        )
    try:
        if os.fspath(path).lower().endswith(".csv"):
            rows = np.loadtxt(path, delimiter=",", ndmin=2)
            q = np.concatenate([rows[:, :3], rows[:, 6:7], rows[:, 3:6], rows[:, FREE:]], axis=1)
            motion = RobotMotion(robot.name, robot.joint_names, np.arange(len(q)) / csv_fps, q)
        else:
            values = read_arrays(path, _KEYS, ROBOT_MOTION)
            names = tuple(str(name) for name in values["joint_names"])
            motion = RobotMotion(str(values["robot"]), names, values["time_s"], values["qpos"])
    except (OSError, ValueError, KeyError, EOFError, IndexError, zipfile.BadZipFile, zlib.error) as error:
        raise FormatError(
            "robot.motion_unreadable",
            "{path} is no motion of a robot: {error}; `studio export --robot` writes one",
            path=path,
            error=str(error)[:120],
        ) from error
    width = robot.model.nq
    if motion.joint_names != robot.joint_names or motion.qpos.ndim != 2 or motion.qpos.shape[1] != width:
        raise FormatError(
            "robot.motion_other",
            "{path} is a motion of another robot than {name}",
            path=path,
            name=robot.name,
        )
    if not np.isfinite(motion.qpos).all() or len(motion.qpos) == 0:
        raise FormatError("robot.motion_not_finite", "{path} has no finite motion", path=path)
    return motion


def part_of(poses: Poses, options: ExportOptions) -> tuple[Poses, Performed]:
    """Return the part of poses that the options choose, on a uniform clock, and its motion as a robot needs it.

    Raises:
        SettingsError: options that are not allowed.
        FormatError: as `performed`.
    """
    check_options(options, "npz", frozenset())
    chosen = resampled(prepared_poses(poses, options))[0]
    return chosen, performed(chosen)


def moved_robot(
    robot: Robot,
    poses: Poses,
    options: ExportOptions | None = None,
    how: Retargeting | None = None,
    *,
    progress: Callable[[float], None] = lambda share: None,
) -> tuple[RobotMotion, Targets]:
    """Return a robot's motion by a performer's whole take, and the targets that it follows.

    Args:
        robot: the robot.
        poses: the performer's poses.
        options: part (`start_s`, `end_s`), rate (`fps`) and smoothing (`smooth_hz`) of the poses.
        how: switches of retargeting; None = the defaults.
        progress: receives the share done.

    Raises:
        SettingsError: options that are not allowed.
        FormatError: poses without arms or legs, or with too few frames.
    """
    chosen, motion = part_of(poses, options or ExportOptions())
    targets = targets_of(robot, motion)
    q, told = retargeted_and_told(robot, targets, how, progress=progress)
    q[:, 3:FREE] = continuous_signs(q[:, 3:FREE])
    return RobotMotion(robot.name, robot.joint_names, chosen.time_s, q, told), targets


def check_format(format: str) -> None:
    """Check that robots' motions can have a format.

    Raises:
        SettingsError: an unknown format.
    """
    if format not in FORMATS:
        raise SettingsError(
            "export.robot_format",
            "format={format}: a robot's motion is {allowed}",
            format=format,
            allowed=[*FORMATS],
        )


def write_motion(motion: RobotMotion, path: str | os.PathLike[str], format: str) -> None:
    """Write a robot's motion in a format.

    Raises:
        SettingsError: an unknown format.
        StudioError: the file cannot be written.
    """
    check_format(format)
    FORMATS[format](motion, path)
