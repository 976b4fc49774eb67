"""The least-squares problem of a robot that follows targets: rows, and their normal equations.

Rows are distances of the robot's points from their targets, accelerations of its joints, and violations: angles and
velocities beyond their limits, and overlap with the floor or itself.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from studio.engine.base.quaternions import rotate
from studio.engine.robots.body.robot import INDEX, Robot
from studio.engine.robots.free_joint import FREE, FREE_DOFS
from studio.engine.robots.moving.balance import balance_rows
from studio.engine.robots.moving.kinematics import ContactRows, Linearised, RobotKinematics
from studio.engine.robots.moving.targets import SOLES, TOUCHING, Targets
from studio.engine.whole_take.finish.banded import BandedNormal, NormalEquations, add_accelerations, add_rows
from studio.engine.whole_take.finish.smoother import HELD, MAX_STEP
from studio.engine.whole_take.finish.trajectory import moved, steps

Array = NDArray[np.float64]

FIRM_ITERATION = 20
"""First Gauss-Newton step with the final deviation of parts that are too near each other."""

ACCELERATION = (6.0, 30.0, 35.0)
"""Standard deviation of accelerations: base [m/s2], base [rad/s2], joints [rad/s2]."""

REST_RAD = 1.5
"""Standard deviation of hinges from the relaxed stance [rad]; it determines what no point constrains."""

LIMIT_RAD = 0.001
VELOCITY_SHARE = 0.95
"""Deviation beyond a limit, and share of the velocity limit that a solve uses as the limit."""

FLOOR_M = 0.001
APART_M, APART_SIGMA_M, APART_SOFT_M = 0.005, 0.002, 0.1
"""Deviation of a sole below the floor; distance that parts keep from each other (0 from the floor), deviation below
it, and that deviation in the first step."""

TOUCH_SIGMA_M = 0.015
"""Deviation of the vector between touching points."""

_TOUCHING = np.array([[INDEX[first], INDEX[second]] for first, second in TOUCHING])
_CORNERS = SOLES.ravel()


@dataclass(frozen=True)
class Retargeting:
    """Switches of retargeting.

    Attributes:
        balance: keep the centre of mass over the support while the performer stands.
        self_contact: keep parts of the robot apart.
        strength: keep torques within the limits that the model gives.
        give_way: change the pose where torques cannot be kept within limits otherwise.
    """

    balance: bool = False
    self_contact: bool = True
    strength: bool = True
    give_way: bool = True


class RobotSolver:
    """The problem of a robot that follows targets: its normal equations at given configurations."""

    def __init__(self, robot: Robot, targets: Targets, options: Retargeting) -> None:
        self._robot, self._options = robot, options
        self.kinematics = RobotKinematics(robot)
        active = robot.active
        self._low, self._high = robot.bent_rad[active].T
        self._rest = robot.rest[active]
        self._reach = robot.velocity_rad_s[active] * targets.frame_s
        count = int(active.sum())
        sigma = np.repeat(ACCELERATION, (3, 3, count))
        self._stiffness = 1.0 / (sigma * targets.frame_s**2) ** 2

    def points(self, q: Array) -> Array:
        """The robot's points, shape (frame_count, point_count, 3)."""
        return self.kinematics.linearised(q).points_m

    def start(self, targets: Targets) -> Array:
        """The base at its target, hinges at rest, shape (frame_count, 7 + active)."""
        robot = self._robot
        hips = [INDEX["left_hip"], INDEX["right_hip"]]
        from_hips = robot.base_m - robot.at_rest_m[hips].mean(axis=0)
        q = np.empty((len(targets), FREE + len(self._rest)))
        q[:, :3] = targets.points_m[:, hips].mean(axis=1) + rotate(targets.hips_wxyz, from_hips)
        q[:, 3:FREE] = targets.hips_wxyz
        q[:, FREE:] = self._rest
        return q

    def stepped(self, q: Array, targets: Targets, held: int, *, apart: float | None) -> Array:
        """Return a window's configurations after one Gauss-Newton step; the first `held` are fixed."""
        normal = self.normal(q, self.linearised(q, apart), targets, apart)
        return moved(q, np.clip(step_of(normal, np.arange(held)), -MAX_STEP, MAX_STEP))

    def linearised(self, q: Array, apart: float | None) -> Linearised:
        """The robot's points, and its contacts where parts are kept apart."""
        return self.kinematics.linearised(q, contacts=apart is not None, mass=self._options.balance)

    def normal(
        self, q: Array, at: Linearised, targets: Targets, apart: float | None, calm: Array | None = None
    ) -> BandedNormal:
        """The normal equations at a window's configurations.

        Args:
            q: the configurations.
            at: the robot's points there.
            targets: targets of its points.
            apart: deviation of parts that are too near each other [m]; None = they may overlap.
            calm: weight factor of accelerations and the relaxed stance, 1 = usual, shape (frame_count,).
        """
        calm = np.ones(len(q)) if calm is None else calm
        normal = _point_rows(at, targets)
        _touch_rows(normal, at, targets)
        _floor_rows(normal, at)
        self._rest_rows(normal, q, calm)
        self._limit_rows(normal, q)
        way = steps(q)
        self._velocity_rows(normal, way)
        acceleration = np.diff(way, axis=0)
        add_accelerations(normal, acceleration, calm[1:-1, None] * self._stiffness)
        if at.contacts is not None and apart is not None:
            contact_rows(normal, at.contacts, apart)
        if self._options.balance:
            add_rows(normal, *balance_rows(at, targets))
        return normal

    def finished(self, q: Array) -> Array:
        """Whole configurations within the limits of angles and velocities."""
        out = q.copy()
        out[:, FREE:] = within_velocity(np.clip(q[:, FREE:], self._low, self._high), self._reach)
        return self.kinematics.whole(out)

    def _rest_rows(self, normal: BandedNormal, q: Array, calm: Array) -> None:
        k = np.arange(FREE_DOFS, q.shape[1] - 1)
        stiffness = calm[:, None] / REST_RAD**2
        normal.diagonal[:, k, k] += stiffness
        normal.right[:, FREE_DOFS:] -= stiffness * (q[:, FREE:] - self._rest)

    def _limit_rows(self, normal: BandedNormal, q: Array) -> None:
        beyond = q[:, FREE:] - np.clip(q[:, FREE:], self._low, self._high)
        k = np.arange(FREE_DOFS, q.shape[1] - 1)
        normal.diagonal[:, k, k] += (beyond != 0.0) / LIMIT_RAD**2
        normal.right[:, FREE_DOFS:] -= beyond / LIMIT_RAD**2

    def _velocity_rows(self, normal: BandedNormal, way: Array) -> None:
        reach = VELOCITY_SHARE * self._reach
        turn = way[:, FREE_DOFS:]
        beyond = turn - np.clip(turn, -reach, reach)
        stiffness = (beyond != 0.0) / LIMIT_RAD**2
        k = np.arange(FREE_DOFS, way.shape[1])
        normal.right[1:, FREE_DOFS:] -= stiffness * beyond
        normal.right[:-1, FREE_DOFS:] += stiffness * beyond
        normal.diagonal[1:, k, k] += stiffness
        normal.diagonal[:-1, k, k] += stiffness
        normal.next[:, k, k] -= stiffness


def step_of(normal: NormalEquations, held: NDArray[np.int64]) -> Array:
    """Solution of normal equations, shape (frame_count, nv); 0 in held frames."""
    k = np.arange(normal.right.shape[1])
    normal.diagonal[held[:, None], k, k] += HELD
    normal.right[held] = 0.0
    step = normal.solve()
    step[held] = 0.0  # rows of torques can be stiffer than `HELD`
    return step


def _point_rows(at: Linearised, targets: Targets) -> BandedNormal:
    frames = len(at.points_m)
    inverse = 1.0 / targets.sigma_m
    residual = ((targets.points_m - at.points_m) * inverse).reshape(frames, -1)
    weighted = at.jacobians * inverse.reshape(frames, -1, 1)
    across = weighted.transpose(0, 2, 1)
    return BandedNormal(np.matmul(across, weighted), np.matmul(across, residual[..., None])[..., 0])


def _touch_rows(normal: BandedNormal, at: Linearised, targets: Targets) -> None:
    """Keep touching points as near to each other as on the performer."""
    jacobians = at.jacobians.reshape(len(at.points_m), -1, 3, at.jacobians.shape[2])
    for pair, (first, second) in enumerate(_TOUCHING):
        near = np.flatnonzero(targets.touching[:, pair] > 0.0)
        if not len(near):
            continue
        rows = jacobians[near, first] - jacobians[near, second]
        way = at.points_m[near, first] - at.points_m[near, second]
        weight = targets.touching[near, pair] / TOUCH_SIGMA_M**2
        normal.diagonal[near] += weight[:, None, None] * np.matmul(rows.transpose(0, 2, 1), rows)
        left = targets.touch_m[near, pair] - way
        normal.right[near] += weight[:, None] * np.einsum("tan,ta->tn", rows, left)


def _floor_rows(normal: BandedNormal, at: Linearised) -> None:
    """Lift corners of soles that are below the floor."""
    height = at.points_m[:, _CORNERS, 2]
    frames, corners = np.nonzero(height < 0.0)
    rows = at.jacobians.reshape(len(height), -1, 3, at.jacobians.shape[2])[frames, _CORNERS[corners], 2]
    add_rows(normal, frames, rows / FLOOR_M, -height[frames, corners] / FLOOR_M)


def apart_m(iteration: int) -> float:
    """Deviation of parts that are too near each other [m]. It falls, so that limbs can pass each other at first."""
    share = min(iteration / FIRM_ITERATION, 1.0)
    return APART_SOFT_M ** (1.0 - share) * APART_SIGMA_M**share


def overlap_m(contacts: ContactRows | None) -> float:
    """Largest depth of a part in another one [m]."""
    if contacts is None:
        return 0.0
    return float(np.max(-contacts.distance_m[~contacts.on_floor], initial=0.0))


def contact_rows(normal: BandedNormal, contacts: ContactRows, sigma_m: float) -> None:
    """Push apart parts that are too near; near parts are damped against steps towards each other."""
    wanted = np.where(contacts.on_floor, 0.0, APART_M)
    too_near = np.maximum(wanted - contacts.distance_m, 0.0)
    add_rows(normal, contacts.frames, contacts.rows / sigma_m, too_near / sigma_m)


def within_velocity(angles: Array, reach: Array) -> Array:
    """Return the angles, shape (frame_count, count), limited so that none changes by more than `reach` in a frame.

    The result is the mean of the lowest function above and the highest below that keep to `reach` (McShane's
    extensions). It equals the angles where they are slow enough, and stays within their range everywhere.
    """
    above, below = angles.copy(), angles.copy()
    for bound, nearer, sign in ((above, np.minimum, 1.0), (below, np.maximum, -1.0)):
        for t in range(1, len(angles)):
            bound[t] = nearer(bound[t], bound[t - 1] + sign * reach)
        for t in range(len(angles) - 2, -1, -1):
            bound[t] = nearer(bound[t], bound[t + 1] + sign * reach)
    return 0.5 * (above + below)
