"""Retargeting of a whole take: all frames of a robot's motion at once.

Minimises, over all frames, the distances of the robot's points from their targets, the accelerations of its joints,
and what must not be: angles beyond their limits, velocities beyond theirs, and overlap with the floor or itself. The
method is finishing's (`whole_take.finish.smoother`): Gauss-Newton on a banded problem.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

import studio.engine.base.blas  # noqa: F401, so that equal input gives equal bits
from studio.engine.base.quaternions import rotate
from studio.engine.robots.body.robot import INDEX, Robot
from studio.engine.robots.free_joint import FREE, FREE_DOFS
from studio.engine.robots.moving.balance import balance_rows
from studio.engine.robots.moving.kinematics import ContactRows, Linearised, RobotKinematics
from studio.engine.robots.moving.targets import SOLES, TOUCHING, Targets, replanted
from studio.engine.robots.moving.torques import RobotTorques
from studio.engine.whole_take.finish.banded import BandedNormal, NormalEquations, add_accelerations, add_rows
from studio.engine.whole_take.finish.smoother import HELD, MAX_STEP
from studio.engine.whole_take.finish.trajectory import moved, steps
from studio.engine.whole_take.physics.blocks import Blocks

Array = NDArray[np.float64]

WINDOW, MARGIN, JOINED = 1500, 120, 2
"""Frames solved at once, frames after them that are solved again with the next window, and frames before a window
that keep what they are."""

ITERATIONS = 32
FIRM_ITERATION = 20
"""Gauss-Newton steps, and the first of them in which parts are kept apart firmly."""

REPLANTED = (8, 13, 18)
"""Steps before which stances move to where the robot's feet are."""

ACCELERATION = (6.0, 30.0, 35.0)
"""Standard deviation of accelerations: base [m/s2], base [rad/s2], joints [rad/s2]."""

REST_RAD = 1.5
"""Standard deviation of hinges from the relaxed stance [rad]; it decides what no point shows."""

LIMIT_RAD = 0.001
VELOCITY_SHARE = 0.95
"""Deviation beyond a limit, and share of the velocity limit from which a solve keeps away."""

FLOOR_M = 0.001
APART_M, APART_SIGMA_M, APART_SOFT_M = 0.005, 0.002, 0.1
"""Deviation of a sole below the floor; distance that parts keep from each other and from the floor, deviation below
it, and the same in the first step."""

TOUCH_SIGMA_M = 0.015
"""Deviation of the distance between what touches."""

STRENGTH_ITERATIONS, STRENGTH_STEP, STRENGTH_PATIENCE = 30, 0.4, 8
"""Most Gauss-Newton steps after the others in which torques are kept within their limits, where any is beyond; share
of each that is gone, since forces of the floor jump from sole to sole; and steps without a better one that end it."""

_TOUCHING = np.array([[INDEX[first], INDEX[second]] for first, second in TOUCHING])
_CORNERS = SOLES.ravel()


@dataclass(frozen=True)
class Retargeting:
    """Switches of retargeting.

    Attributes:
        balance: keep the centre of mass over the support while the performer stands.
        self_contact: keep parts of the robot apart.
        strength: keep torques within the limits that the model gives, as far as the motion allows.
    """

    balance: bool = False
    self_contact: bool = True
    strength: bool = True


def retargeted(
    robot: Robot,
    targets: Targets,
    options: Retargeting | None = None,
    *,
    progress: Callable[[float], None] = lambda share: None,
) -> Array:
    """Return a robot's configurations, shape (frame_count, nq), in MuJoCo's order; quaternions wxyz.

    Every hinge is within its limits, and changes by no more per frame than its velocity allows.
    """
    options = options or Retargeting()
    solver = _Solver(robot, targets, options)
    q = solver.start(targets)
    for begin in range(0, len(q), WINDOW):
        low, high = max(begin - JOINED, 0), min(begin + WINDOW + MARGIN, len(q))
        if low > 0 and high - begin <= MARGIN:  # solved with the window before
            break
        rows = slice(low, high)
        for iteration in range(ITERATIONS):
            if iteration in REPLANTED:
                targets = replanted(robot, targets, solver.points(q[rows]), rows)
            apart = _apart(iteration) if options.self_contact else None
            q[rows] = solver.stepped(q[rows], targets.part(rows), begin - low, apart=apart)
            progress((begin + (high - begin) * (iteration + 1) / ITERATIONS) / len(q))
        if options.strength:
            q[rows] = solver.weaker(q[rows], targets.part(rows), begin - low)
    return solver.finished(q)


class _Solver:
    def __init__(self, robot: Robot, targets: Targets, options: Retargeting) -> None:
        self._robot, self._options = robot, options
        self._kinematics = RobotKinematics(robot)
        active = robot.active
        self._low, self._high = robot.bent_rad[active].T
        self._rest = robot.rest[active]
        self._reach = robot.velocity_rad_s[active] * targets.frame_s
        count = int(active.sum())
        sigma = np.repeat(ACCELERATION, (3, 3, count))
        self._torques = RobotTorques(robot, targets.frame_s)
        self._stiffness = 1.0 / (sigma * targets.frame_s**2) ** 2

    def points(self, q: Array) -> Array:
        """The robot's points, shape (frame_count, point_count, 3)."""
        return self._kinematics.linearised(q).points_m

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
        """A window's configurations after one Gauss-Newton step; the first `held` stay."""
        return _moved(q, self._normal(q, self._linearised(q, apart), targets, apart), held)

    def weaker(self, q: Array, targets: Targets, held: int) -> Array:
        """A window's configurations with torques nearer their limits: the best of several steps, in none of whose
        frames parts overlap by more than they did, or by twice `APART_M`."""
        if not self._torques.given or len(q) < 3:
            return q
        apart = _apart(ITERATIONS) if self._options.self_contact else None
        best, least, since, deepest = q, np.inf, 0, np.inf
        for _ in range(STRENGTH_ITERATIONS + 1):
            at = self._linearised(q, apart)
            normal = self._normal(q, at, targets, apart)
            if at.contacts is not None:  # what is weak must not lean on the floor
                _contact_rows(normal, at.contacts.part(at.contacts.on_floor), FLOOR_M)
            blocks = Blocks.of(normal)
            beyond = self._torques.add_rows(blocks, self._kinematics.whole(q), self._kinematics.dofs)
            overlap = _overlap_m(at.contacts)
            if best is q:
                deepest = max(overlap, 2.0 * APART_M)
            better = beyond < least and overlap <= deepest
            best, least, since = (q, beyond, 0) if better else (best, least, since + 1)
            if least == 0.0 or since > STRENGTH_PATIENCE:
                break
            q = _moved(q, blocks, held, STRENGTH_STEP)
        return best

    def _linearised(self, q: Array, apart: float | None) -> Linearised:
        return self._kinematics.linearised(q, contacts=apart is not None, mass=self._options.balance)

    def _normal(self, q: Array, at: Linearised, targets: Targets, apart: float | None) -> BandedNormal:
        """The normal equations at a window's configurations."""
        normal = _point_rows(at, targets)
        _touch_rows(normal, at, targets)
        _floor_rows(normal, at)
        self._rest_rows(normal, q)
        self._limit_rows(normal, q)
        way = steps(q)
        self._velocity_rows(normal, way)
        acceleration = np.diff(way, axis=0)
        add_accelerations(normal, acceleration, np.broadcast_to(self._stiffness, acceleration.shape))
        if at.contacts is not None and apart is not None:
            _contact_rows(normal, at.contacts, apart)
        if self._options.balance:
            add_rows(normal, *balance_rows(at, targets))
        return normal

    def finished(self, q: Array) -> Array:
        """Whole configurations within the limits of angles and velocities."""
        out = q.copy()
        out[:, FREE:] = within_velocity(np.clip(q[:, FREE:], self._low, self._high), self._reach)
        return self._kinematics.whole(out)

    def _rest_rows(self, normal: BandedNormal, q: Array) -> None:
        k = np.arange(FREE_DOFS, q.shape[1] - 1)
        normal.diagonal[:, k, k] += 1.0 / REST_RAD**2
        normal.right[:, FREE_DOFS:] -= (q[:, FREE:] - self._rest) / REST_RAD**2

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


def _moved(q: Array, normal: NormalEquations, held: int, share: float = 1.0) -> Array:
    """Configurations moved by a share of the solution of normal equations; the first `held` stay."""
    k = np.arange(q.shape[1] - 1)
    normal.diagonal[:held, k[:, None], k[:, None]] += HELD
    normal.right[:held] = 0.0
    return moved(q, share * np.clip(normal.solve(), -MAX_STEP, MAX_STEP))


def _point_rows(at: Linearised, targets: Targets) -> BandedNormal:
    frames = len(at.points_m)
    inverse = 1.0 / targets.sigma_m
    residual = ((targets.points_m - at.points_m) * inverse).reshape(frames, -1)
    weighted = at.jacobians * inverse.reshape(frames, -1, 1)
    across = weighted.transpose(0, 2, 1)
    return BandedNormal(np.matmul(across, weighted), np.matmul(across, residual[..., None])[..., 0])


def _touch_rows(normal: BandedNormal, at: Linearised, targets: Targets) -> None:
    """Keep what touches as near as on the performer."""
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


def _apart(iteration: int) -> float:
    """Deviation of parts that are too near each other [m]: it falls, so that a limb passes another on the way."""
    share = min(iteration / FIRM_ITERATION, 1.0)
    return APART_SOFT_M ** (1.0 - share) * APART_SIGMA_M**share


def _overlap_m(contacts: ContactRows | None) -> float:
    """How deep a part is in another one at most."""
    if contacts is None:
        return 0.0
    return float(np.max(-contacts.distance_m[~contacts.on_floor], initial=0.0))


def _contact_rows(normal: BandedNormal, contacts: ContactRows, sigma_m: float) -> None:
    """Push parts apart that are too near; a step towards each other is damped where they are near."""
    wanted = np.where(contacts.on_floor, 0.0, APART_M)
    too_near = np.maximum(wanted - contacts.distance_m, 0.0)
    add_rows(normal, contacts.frames, contacts.rows / sigma_m, too_near / sigma_m)


def within_velocity(angles: Array, reach: Array) -> Array:
    """Return the angles, shape (frame_count, count), so that none changes by more than `reach` in a frame.

    The result is the middle between the lowest function above and the highest below that are that slow (McShane's
    extensions): it is the same where the angles are slow enough, and within their range everywhere.
    """
    above, below = angles.copy(), angles.copy()
    for bound, nearer, sign in ((above, np.minimum, 1.0), (below, np.maximum, -1.0)):
        for t in range(1, len(angles)):
            bound[t] = nearer(bound[t], bound[t - 1] + sign * reach)
        for t in range(len(angles) - 2, -1, -1):
            bound[t] = nearer(bound[t], bound[t + 1] + sign * reach)
    return 0.5 * (above + below)
