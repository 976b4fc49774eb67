"""Robots in the performers' place: the one that everybody is drawn as, and its motion for the replay."""

import threading
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Protocol

import numpy as np
from numpy.typing import NDArray

from studio.api.jobs import UNDER_WAY, Jobs
from studio.engine.base.errors import StudioError
from studio.engine.robots.files import kept_robots, load_robot
from studio.take.folder.take import Take
from studio.web.playback.clip import Clip
from studio.web.playback.finder import TakeFinder
from studio.web.playback.growing import GrowingClip
from studio.web.scene.performers.robot import ChosenRobot

if TYPE_CHECKING:
    from studio.engine.robots.body.robot import Robot
    from studio.engine.robots.motion import RobotMotion
    from studio.engine.robots.moving.gave_way import GaveWay
    from studio.engine.robots.strain import StrainedJoint

KIND = "robot"
"""Kind of the job that retargets a solve."""


@dataclass(frozen=True)
class ReplayedRobot:
    """A robot's motions that follow the performers of a solve.

    Attributes:
        name: of the robot.
        take, solve: whose solve.
        motions: by the performer's number.
        strained: joints of which the motions demand too much torque, by the performer's number.
    """

    name: str = ""
    take: str = ""
    solve: str = ""
    motions: "Mapping[int, RobotMotion]" = field(default_factory=dict)
    strained: "Mapping[int, Sequence[StrainedJoint]]" = field(default_factory=dict)

    def of(self, clip: Clip) -> bool:
        """Whether a clip is of this solve."""
        return (clip.take, clip.solve) == (self.take, self.solve)

    def at(self, clip: Clip, frame: int) -> dict[int, NDArray[np.float64]]:
        """Return the configurations at a frame of a clip by the performer's number; none for another solve."""
        if not self.of(clip):
            return {}
        time_s = float(clip.poses.time_s[frame])
        return {
            number: motion.qpos[_nearest(motion.time_s, time_s)] for number, motion in self.motions.items()
        }


NO_ROBOT = ReplayedRobot()


def _as_drawn(robot: "Robot") -> ChosenRobot:
    from studio.engine.robots.body.shapes import robot_shapes

    return ChosenRobot(robot, robot_shapes(robot))


def _nearest(times: NDArray[np.float64], time_s: float) -> int:
    after = min(int(np.searchsorted(times, time_s)), len(times) - 1)
    before = max(after - 1, 0)
    return before if time_s - times[before] < times[after] - time_s else after


class _View(Protocol):
    """The view's interface."""

    def choose_robot(self, chosen: ChosenRobot | None) -> None: ...


class _Player(Protocol):
    """The player's interface."""

    @property
    def clip(self) -> Clip | None: ...
    def show_robot(self, robot: ReplayedRobot) -> None: ...


class ChosenRobots:
    """The choice of a robot for all browsers. All methods but `names`, `strained` and `gave_way` may take seconds."""

    def __init__(self, view: _View, player: _Player, takes: TakeFinder, jobs: Jobs, folder: Path) -> None:
        """`folder`: of the kept robots."""
        self._view, self._player, self._takes, self._jobs = view, player, takes, jobs
        self._folder = folder
        self._lock = threading.Lock()
        self._chosen: ChosenRobot | None = None
        self._replayed = NO_ROBOT

    @property
    def name(self) -> str:
        """Name of the robot that everybody is drawn as; "" = none."""
        return "" if self._chosen is None else self._chosen.robot.name

    def names(self) -> list[str]:
        """Names of the kept robots."""
        return kept_robots(self._folder)

    def strained(self) -> "Mapping[int, Sequence[StrainedJoint]]":
        """Joints of which the motions for the replayed solve demand too much torque, by the performer's number."""
        clip, replayed = self._player.clip, self._replayed
        return replayed.strained if clip is not None and replayed.of(clip) else {}

    def gave_way(self) -> "Mapping[int, Sequence[GaveWay]]":
        """Times at which the motions for the replayed solve gave way for their torques, by the performer's number."""
        clip, replayed = self._player.clip, self._replayed
        if clip is None or not replayed.of(clip):
            return {}
        return {number: motion.gave_way for number, motion in replayed.motions.items()}

    def choose(self, name: str) -> None:
        """Draw everybody as a kept robot, or as a mannequin ("").

        Raises:
            FormatError: as `load_robot`.
        """
        chosen = _as_drawn(load_robot(self._folder, name)) if name else None
        with self._lock:
            self._chosen = chosen
            self._view.choose_robot(chosen)
        self.follow_replay()

    def follow_replay(self) -> None:
        """Show the robot's motion for the replayed solve: the kept one, else compute it. Until it is ready, the robot
        follows frame by frame."""
        chosen, clip = self._chosen, self._player.clip
        if chosen is None or clip is None or not clip.solve or isinstance(clip, GrowingClip):
            self._show(NO_ROBOT)
        elif not self._shows_kept(chosen, clip):
            self._compute(chosen.robot.name, clip)

    def _shows_kept(self, chosen: ChosenRobot, clip: Clip) -> bool:
        """Show the kept motion, if there is one for these poses."""
        from studio.offline.robots import kept_robot_motions

        robot = chosen.robot
        kept = kept_robot_motions(self._take(clip), clip.solve, self._folder, robot)
        if kept is not None:
            motions = {number: one.motion for number, one in kept.items()}
            strained = {number: one.strained for number, one in kept.items()}
            self._show(ReplayedRobot(robot.name, clip.take, clip.solve, motions, strained))
        return kept is not None

    def _show(self, replayed: ReplayedRobot) -> None:
        self._replayed = replayed
        self._player.show_robot(replayed)

    def _compute(self, name: str, clip: Clip) -> None:
        title = f"{clip.solve}: {name}"
        with self._lock:
            known = [(job.kind, job.take, job.name) for job in self._jobs.list() if job.state in UNDER_WAY]
            if (KIND, clip.take, title) not in known:
                self._jobs.submit(
                    KIND, clip.take, title, "studio.offline.robots:keep_robot_motions",
                    self._take(clip), clip.solve, self._folder, name, then=self._computed,
                )  # fmt: skip

    def _computed(self, _: object) -> None:
        chosen, clip = self._chosen, self._player.clip
        if chosen is None or clip is None or not clip.solve:
            return
        with suppress(StudioError, OSError):  # the take was removed meanwhile
            self._shows_kept(chosen, clip)

    def _take(self, clip: Clip) -> Take:
        session, _, name = clip.take.partition("/")
        return self._takes.take(session, name)
