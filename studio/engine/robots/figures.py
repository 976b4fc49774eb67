"""Figures of a robot's motion: how well it follows its targets, stands, and keeps within its limits."""

from dataclasses import asdict, dataclass, fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

from studio.engine.robots.body.robot import INDEX, Robot
from studio.engine.robots.free_joint import FREE
from studio.engine.robots.moving.balance import outside, standing_frames
from studio.engine.robots.moving.kinematics import RobotKinematics
from studio.engine.robots.moving.targets import KEY_POINTS, SOLES, Targets
from studio.engine.robots.strain import ROUNDING, StrainedJoint, strained_joints, torque_shares

Array = NDArray[np.float64]

DEEP_M = 0.005
"""Overlap above which parts penetrate."""

_KEY_POINTS = [INDEX[point] for point in KEY_POINTS]


@dataclass(frozen=True)
class RobotFigures:
    """Figures of a robot's motion. Stances are the performer's; None where there are none.

    Attributes:
        foot_slide_cm_s: mean horizontal speed of standing corners of soles.
        floating_mm: mean height of those corners over the floor.
        floor_penetration_share, self_penetration_share: frames in which any part is more than 5 mm in the floor, or
            in another part.
        floor_penetration_mm, self_penetration_mm: largest depth.
        limit_share: frames with a hinge beyond its limits.
        velocity_share: steps in which a hinge is faster than its limit.
        acceleration_rad_s2: root mean square over hinges and frames.
        torque_share: frames with a torque beyond its limit; None where the model gives no limits.
        torque_most: the largest torque, as a share of its limit.
        key_point_mm: mean distance of knees, ankles, shoulders, elbows and hands from the scaled performer's.
        balance_share: standing frames with the centre of mass over the support.
        frames: number of frames.
        strained: joints with torques beyond their limits, the most frequent first.
    """

    foot_slide_cm_s: float | None
    floating_mm: float | None
    floor_penetration_share: float
    floor_penetration_mm: float
    self_penetration_share: float
    self_penetration_mm: float
    limit_share: float
    velocity_share: float
    acceleration_rad_s2: float
    torque_share: float | None
    torque_most: float | None
    key_point_mm: float
    balance_share: float | None
    frames: int
    strained: tuple[StrainedJoint, ...] = ()

    def as_dict(self) -> dict[str, Any]:
        """Return the figures by name."""
        return asdict(self)


FIGURES: tuple[str, ...] = tuple(field.name for field in fields(RobotFigures) if field.name != "strained")
"""Names of the numeric figures."""


def robot_figures(robot: Robot, q: Array, targets: Targets) -> RobotFigures:
    """Return the figures of configurations, shape (frame_count, nq), for the targets of the same frames."""
    kinematics, frames = RobotKinematics(robot), len(q)
    reduced = kinematics.reduced(q)
    at = kinematics.linearised(reduced, contacts=True)
    assert at.contacts is not None
    soles = at.points_m[:, SOLES]
    stands = targets.standing
    on = stands[1:] & stands[:-1]
    speed = np.linalg.norm(np.diff(soles[..., :2], axis=0), axis=3) / targets.frame_s
    hinges = reduced[:, FREE:]
    turn = np.diff(hinges, axis=0)
    reach = robot.velocity_rad_s[robot.active] * targets.frame_s
    low, high = robot.range_rad[robot.active].T
    beyond = (hinges < low - ROUNDING) | (hinges > high + ROUNDING)
    acceleration = np.diff(turn, axis=0) / targets.frame_s**2
    floor = (at.contacts.bodies == 0).any(axis=1)
    depth = -at.contacts.distance_m
    sunk = np.maximum(-soles[..., 2].min(axis=(1, 2)), 0.0)
    np.maximum.at(sunk, at.contacts.frames[floor], depth[floor])
    inside = np.zeros(frames)
    np.maximum.at(inside, at.contacts.frames[~floor], depth[~floor])
    off = np.linalg.norm(at.points_m[:, _KEY_POINTS] - targets.points_m[:, _KEY_POINTS], axis=2)
    still = standing_frames(targets)
    away = outside(at.mass_m[still], soles[still], stands[still])
    strain = torque_shares(robot, q, targets.frame_s)
    return RobotFigures(
        foot_slide_cm_s=float(100.0 * speed[on].mean()) if on.any() else None,
        floating_mm=float(1000.0 * np.maximum(soles[..., 2][stands], 0.0).mean()) if stands.any() else None,
        floor_penetration_share=float((sunk > DEEP_M).mean()),
        floor_penetration_mm=float(1000.0 * sunk.max()),
        self_penetration_share=float((inside > DEEP_M).mean()),
        self_penetration_mm=float(1000.0 * inside.max()),
        limit_share=float(beyond.any(axis=1).mean()),
        velocity_share=float((np.abs(turn) > reach * (1.0 + ROUNDING)).any(axis=1).mean()),
        acceleration_rad_s2=float(np.sqrt((acceleration**2).mean())),
        torque_share=None if strain is None else float((strain > 1.0 + ROUNDING).any(axis=1).mean()),
        torque_most=None if strain is None else float(strain.max()),
        key_point_mm=float(1000.0 * off.mean()),
        balance_share=float((away == 0.0).all(axis=1).mean()) if still.any() else None,
        frames=frames,
        strained=strained_joints(robot, strain, targets.frame_s),
    )
