"""What a user is shown of a robot: its parts, sizes and limits, and what was assumed."""

from typing import TypedDict

import mujoco
import numpy as np

from studio.engine.robots.body.robot import INDEX, Robot

_AXES = ("roll", "pitch", "yaw")


class JointFacts(TypedDict):
    """A hinge: its limits, and about which axis it turns in the zero pose; `held` is one that no part needs;
    `torque_nm` the smaller of both directions' limits, None where the model gives none."""

    name: str
    low_rad: float
    high_rad: float
    velocity_rad_s: float
    torque_nm: float | None
    turns: str


class RobotFacts(TypedDict):
    """A robot as measured; lengths in metres."""

    name: str
    parts: dict[str, str]
    joints: list[JointFacts]
    moved: int
    height_m: float
    leg_m: float
    lengths_m: dict[str, float]
    sole_m: list[float]
    mass_kg: float
    notes: list[str]


def robot_facts(robot: Robot) -> RobotFacts:
    """Return what a user is shown of a robot."""
    data = mujoco.MjData(robot.model)
    mujoco.mj_kinematics(robot.model, data)
    joints: list[JointFacts] = []
    for k, name in enumerate(robot.joint_names):
        axis = _AXES[int(np.argmax(np.abs(data.xaxis[k + 1])))]
        joints.append(
            {
                "name": name,
                "low_rad": float(robot.range_rad[k, 0]),
                "high_rad": float(robot.range_rad[k, 1]),
                "velocity_rad_s": float(robot.velocity_rad_s[k]),
                "torque_nm": _finite(float(np.abs(robot.torque_nm[k]).min())),
                "turns": axis if robot.active[k] else "held",
            }
        )
    back, front, inner, outer = (
        robot.at_rest_m[INDEX[f"left_{corner}"]] for corner in ("heel_in", "toe_in", "heel_in", "heel_out")
    )
    notes = []
    if robot.unlimited:
        notes.append(f"joints without limits, +-3.14 rad are taken: {', '.join(robot.unlimited)}")
    if not np.isfinite(robot.torque_nm).any():
        notes.append("its file gives no torque limits: torques are not judged")
    if not robot.collides:
        notes.append("nothing of it collides in its file: it is not kept from overlapping itself")
    return {
        "name": robot.name,
        "parts": dict(robot.parts),
        "joints": joints,
        "moved": int(robot.active.sum()),
        "height_m": robot.height_m,
        "leg_m": robot.leg_m,
        "lengths_m": dict(robot.lengths_m),
        "sole_m": [float(abs(front[0] - back[0])), float(abs(outer[1] - inner[1]))],
        "mass_kg": float(robot.model.body_mass.sum()),
        "notes": notes,
    }


def _finite(value: float) -> float | None:
    return value if np.isfinite(value) else None
