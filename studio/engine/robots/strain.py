"""Joints whose torques exceed their limits in a robot's motion: which, when, and how far."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from studio.engine.robots.body.robot import Robot
from studio.engine.robots.motion import RobotMotion
from studio.engine.robots.moving.torques import RobotTorques

Array = NDArray[np.float64]

ROUNDING = 1e-6


@dataclass(frozen=True)
class StrainedJoint:
    """A joint whose torque exceeds its limit in a motion.

    Attributes:
        joint: its name.
        frame_share: share of frames beyond the limit.
        most: the largest torque, as a share of the limit.
        at_s: time of the largest torque since the performance began [s].
    """

    joint: str
    frame_share: float
    most: float
    at_s: float


def torque_shares(robot: Robot, qpos: Array, frame_s: float) -> Array | None:
    """Return torques as shares of their limits; None where the model gives no limits or the motion is too short.

    Args:
        robot: the robot that moves.
        qpos: its configurations, shape (frame_count, nq).
        frame_s: time between frames [s].

    Returns:
        At the inner frames, shape (frame_count - 2, hinge_count).
    """
    torques = RobotTorques(robot, frame_s)
    return torques.strain(qpos).shares if torques.given and len(qpos) > 2 else None


def strained_joints(
    robot: Robot, shares: Array | None, frame_s: float, begin_s: float = 0.0
) -> tuple[StrainedJoint, ...]:
    """Return the joints with torques beyond their limits, the most frequent first.

    Args:
        robot: the robot.
        shares: result of `torque_shares`.
        frame_s: time between frames [s].
        begin_s: time of the first frame since the performance began [s].
    """
    if shares is None:
        return ()
    beyond = (shares > 1.0 + ROUNDING).mean(axis=0)
    worst = shares.argmax(axis=0)
    return tuple(
        StrainedJoint(
            joint=robot.joint_names[k],
            frame_share=float(beyond[k]),
            most=float(shares[worst[k], k]),
            at_s=float(begin_s + (worst[k] + 1) * frame_s),
        )
        for k in np.argsort(-beyond, kind="stable")
        if beyond[k] > 0.0
    )


def strain_of(robot: Robot, motion: RobotMotion, begins_s: float | None = None) -> tuple[StrainedJoint, ...]:
    """Return the joints with torques beyond their limits; none where the model gives no limits.

    `begins_s`: stage time at which the performance begins; None = when the motion begins.
    """
    frame_s = 1.0 / motion.frames_per_second
    begin_s = 0.0 if begins_s is None else float(motion.time_s[0]) - begins_s
    return strained_joints(robot, torque_shares(robot, motion.qpos, frame_s), frame_s, begin_s)


def strain_text(strained: Sequence[StrainedJoint]) -> str:
    """Return the strained joints as text for an operator, in the given order."""
    told = [
        f"{one.joint} in {100.0 * one.frame_share:.1f} % of frames, at most {one.most:.1f} times its limit "
        f"at {one.at_s:.2f} s"
        for one in strained
    ]
    return "torques beyond limits: " + ("; ".join(told) or "none")
