"""Joint targets of a robot that follows a live performer: one message per period, also without a performer.

Every joint stays within its limits of angle and velocity, from one message to the next. While no step arrives, or no
camera sees the performer, the robot comes to rest and holds; afterwards, and at the beginning, it starts slowly.
"""

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

import msgspec
import numpy as np
from numpy.typing import NDArray

from studio.engine.model.frames import StepResult
from studio.engine.robots.free_joint import FREE
from studio.streams.between import PosesBetween
from studio.streams.cast import Cast, steps_of

if TYPE_CHECKING:
    from studio.engine.robots.body.robot import Robot

FORMAT_VERSION = 1
PORT = 14600
RATES_HZ = (50.0, 100.0)

WATCHDOG_S = 0.25
"""Time without data after which a performer is lost."""

RESUME_S = 1.5
SLOW = 0.1
"""Time in which a robot that starts to follow reaches full velocity [s], and the initial share of the velocity."""

WAIT, FOLLOW, HOLD = "wait", "follow", "hold"


class JointTargets:
    """The joint targets of one robot, period by period."""

    def __init__(self, robot: "Robot", rate_hz: float, cast: Cast, performer: str) -> None:
        """`performer`: name of the performer to follow; "" = the first."""
        self._robot, self._rate_hz = robot, rate_hz
        self._cast, self._performer = cast, performer
        from studio.engine.robots.moving.stage_frames import StageFollower

        self._follower = StageFollower(robot, 1.0 / rate_hz, at_once=False)
        self._poses = PosesBetween()
        self._seen_s: float | None = None
        self._time_s: float | None = None
        self._begun_s: float | None = None
        self._last = robot.standing[FREE:]
        self._sequence = 0

    def head(self) -> dict[str, Any]:
        """Return the head, the message that describes the others."""
        return {
            "type": "robot",
            "format_version": FORMAT_VERSION,
            "robot": self._robot.name,
            "joint_names": list(self._robot.joint_names),
            "low_rad": self._robot.range_rad[:, 0].round(5).tolist(),
            "high_rad": self._robot.range_rad[:, 1].round(5).tolist(),
            "velocity_rad_s": self._robot.velocity_rad_s.round(5).tolist(),
            "rate_hz": self._rate_hz,
            "watchdog_ms": round(1e3 * WATCHDOG_S),
        }

    def take(self, result: StepResult, now_s: float) -> None:
        """Add a step of the stage that arrived at a time [s]."""
        steps = steps_of(result, self._cast(), self._performer)
        if not steps:
            return
        one = steps[0][0]
        known = np.isfinite(one.positions_m).all() and np.isfinite(one.rotations_wxyz).all()
        if known and np.isfinite(one.frame_set.positions).any():
            self._poses.add(one, now_s)
            self._seen_s = now_s

    def message(self, now_s: float) -> dict[str, Any]:
        """Return the next message, for the time `now_s` [s]; to be called once per period."""
        state, q = self._next(now_s)
        joints = q[FREE:]
        speed, self._last = (joints - self._last) * self._rate_hz, joints
        self._sequence += 1
        return {
            "type": "joint_targets",
            "sequence": self._sequence,
            "state": state,
            "time_s": self._time_s,
            "base_m": q[:3].round(5).tolist(),
            "base_wxyz": q[3:FREE].round(6).tolist(),
            "joints_rad": joints.round(6).tolist(),
            "joints_rad_s": speed.round(5).tolist(),
        }

    def _next(self, now_s: float) -> tuple[str, NDArray[np.float64]]:
        if self._seen_s is None:
            return WAIT, self._follower.hold()
        if now_s - self._seen_s > WATCHDOG_S:
            self._begun_s = None
            return HOLD, self._follower.hold()
        if self._begun_s is None:
            self._begun_s = now_s
        pace = SLOW + (1.0 - SLOW) * min((now_s - self._begun_s) / RESUME_S, 1.0)
        pose = self._poses.at(now_s)
        self._time_s = pose.time_s
        return FOLLOW, self._follower.follow(
            pose.positions_m, pose.rotations_wxyz, pose.root_height_m, pose.time_s, pace
        )


def encoded(message: Mapping[str, Any]) -> bytes:
    """Return a message as JSON."""
    return msgspec.json.encode(message)


Load = Callable[[str], "Robot"]
"""Returns a stored robot by its name; raises FormatError."""
