"""Describes a robot for its user: its parts, sizes and limits, and what was assumed."""

from collections.abc import Mapping
from pathlib import Path

import mujoco
import numpy as np

from studio.engine.base.sentences import say
from studio.engine.robots.body.robot import INDEX, Robot
from studio.engine.robots.facts import JointFacts, RobotFacts
from studio.engine.robots.files import correct_robot, load_robot

_AXES = ("roll", "pitch", "yaw")


def robot_facts(robot: Robot) -> RobotFacts:
    """Return the facts of a robot."""
    data = mujoco.MjData(robot.model)
    mujoco.mj_kinematics(robot.model, data)
    joints: list[JointFacts] = []
    for k, name in enumerate(robot.joint_names):
        axis = _AXES[int(np.argmax(np.abs(data.xaxis[k + 1])))]
        joints.append(
            JointFacts(
                name=name,
                low_rad=float(robot.range_rad[k, 0]),
                high_rad=float(robot.range_rad[k, 1]),
                velocity_rad_s=float(robot.velocity_rad_s[k]),
                torque_nm=_finite(float(np.abs(robot.torque_nm[k]).min())),
                turns=axis if robot.active[k] else "held",
            )
        )
    back, front, inner, outer = (
        robot.at_rest_m[INDEX[f"left_{corner}"]] for corner in ("heel_in", "toe_in", "heel_in", "heel_out")
    )
    notes: list[str] = []
    if robot.unlimited:
        notes.append(
            say(
                "robot.note_unlimited",
                "joints without limits, +-3.14 rad are taken: {names}",
                names=[*robot.unlimited],
            )
        )
    if not np.isfinite(robot.torque_nm).any():
        notes.append(say("robot.note_torques", "its file gives no torque limits: torques are not judged"))
    if not robot.collides:
        notes.append(
            say(
                "robot.note_overlaps",
                "nothing of it collides in its file: it is not kept from overlapping itself",
            )
        )
    return RobotFacts(
        name=robot.name,
        parts=dict(robot.parts),
        bodies=[robot.model.body(k).name for k in range(1, robot.model.nbody)],
        joints=joints,
        moved=int(robot.active.sum()),
        height_m=robot.height_m,
        leg_m=robot.leg_m,
        lengths_m=dict(robot.lengths_m),
        sole_m=[float(abs(front[0] - back[0])), float(abs(outer[1] - inner[1]))],
        mass_kg=float(robot.model.body_mass.sum()),
        notes=notes,
    )


def kept_facts(folder: Path, name: str) -> RobotFacts:
    """Return the facts of a kept robot.

    Raises:
        FormatError: as `load_robot`.
    """
    return robot_facts(load_robot(folder, name))


def correct_and_tell(
    folder: Path, name: str, parts: Mapping[str, str], velocity_rad_s: float | None
) -> RobotFacts:
    """Correct a kept robot as `correct_robot` does, and return its facts."""
    return robot_facts(correct_robot(folder, name, parts, velocity_rad_s))


def _finite(value: float) -> float | None:
    return value if np.isfinite(value) else None
