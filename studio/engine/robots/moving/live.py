"""The live way: a robot follows a performer frame by frame, by mink with the points of the whole take.

Each frame starts from the one before. Stances are found from past frames only: a standing foot keeps the position of
its sole. Limits of angles and velocities are bounds of every step, so every frame has a solution.
"""

from collections.abc import Callable
from dataclasses import replace
from typing import Any, cast

import mink
import numpy as np
from numpy.typing import NDArray

from studio.engine.robots.body.collisions import ContactFinder
from studio.engine.robots.body.robot import INDEX, Robot
from studio.engine.robots.free_joint import FREE, FREE_DOFS
from studio.engine.robots.moving.kinematics import body_dofs, contact_rows
from studio.engine.robots.moving.performed import FEET, Performed
from studio.engine.robots.moving.targets import (
    SOLES,
    Targets,
    corner_hold,
    flat_pose,
    flat_sole,
    scaled,
    sole_of,
    sole_sigma_m,
)
from studio.engine.solve.ik.box_qp import UNBOUNDED, BoxQP
from studio.engine.solve.ik.tasks import JointPositionsTask

Array = NDArray[np.float64]

_build_ik = cast("Callable[..., Any]", mink.build_ik)
"""mink's types allow a sparse matrix, but it is always dense."""

FIRST_ITERATIONS = 3
"""Steps of a first frame. They let parts overlap, because the contacts of a jump are many and deep: finding them
takes as long as the rest of the frame. The next frames push the parts apart."""

MAX_STEP_RAD, FIRST_STEP_RAD = 0.3, 0.6
"""Largest rotation of a hinge in a frame, and in each step of a first frame."""

VELOCITY_SHARE = 0.9
"""Share of the last frame's velocity that is expected in the next one."""

STOP_SHARE = 0.8
"""The same while there is nobody to follow."""

DAMPING = 1e-3
REST_RAD = 1.5
BASE_SIGMA = (2.0, 6.0)
HINGE_SIGMA_RAD_S = 4.0
"""Standard deviation of velocity changes: base [m/s], [rad/s], and hinges [rad/s]."""

STAND_M_S, LEAVE_M_S = 0.30, 0.45
STAND_M, LEAVE_M = 0.03, 0.045
"""Speed and height below which a foot's joint begins to stand, and above which it stops standing."""

APART_M, APART_SIGMA_M = 0.005, 0.004
"""Distance that parts keep from each other, and the deviation below it or below the floor."""

LIVE_SIGMA_M = 0.001
"""Least standard deviation of the corners of standing soles."""

EASE_S = 0.05
SMOOTHING_S = 0.03


class LiveStances:
    """Detects which joints of the performer's feet stand, from their speed and height so far."""

    def __init__(self, stand_m: Array, frame_s: float) -> None:
        """`stand_m`: standing heights of left ankle and toe, right ankle and toe, shape (4,)."""
        self._stand_m, self._frame_s = stand_m, frame_s
        self._smooth: Array | None = None
        self._velocity = np.zeros((4, 3))
        self._stands = np.zeros(4, dtype=bool)
        self._hold = np.zeros(4)

    def follow(self, feet: Array) -> Array:
        """Return how much each joint stands, 0..1, shape (4,), from their positions [m], shape (4, 3)."""
        share = 1.0 - np.exp(-self._frame_s / SMOOTHING_S)
        before = feet if self._smooth is None else self._smooth
        moved = share * (feet - before)
        self._smooth = before + moved
        speed = np.linalg.norm(moved, axis=1) / self._frame_s
        height = feet[:, 2] - self._stand_m
        near = (speed < STAND_M_S) & (height < STAND_M)
        away = (speed > LEAVE_M_S) | (height > LEAVE_M)
        self._stands = np.where(self._stands, ~away, near)
        self._hold = np.clip(
            self._hold + np.where(self._stands, 1.0, -1.0) * self._frame_s / EASE_S, 0.0, 1.0
        )
        return self._hold.copy()


class LiveFeet:
    """Positions of standing feet: each keeps the position at which its target was first flat for its whole stance."""

    def __init__(self, robot: Robot) -> None:
        self._local = [sole_of(robot, side) for side in (0, 1)]
        self._placed: list[Array | None] = [None, None]

    def plant(self, targets: Targets, hold: Array) -> Targets:
        """Return one frame's targets with its standing feet in place.

        Args:
            targets: targets of one frame; modified.
            hold: how much the performer's ankles and toes stand, shape (4,).
        """
        corners = corner_hold(hold[None])
        soles = targets.points_m[:, SOLES]
        for k, local in enumerate(self._local):
            own = corners[0, k]
            if own.max() <= 0.0:
                self._placed[k] = None
                continue
            if self._placed[k] is None or own.max() < 1.0:
                pose = flat_pose(local, soles[:, k], own[2:3] > 0.0)
                self._placed[k] = flat_sole(local, *pose)[0]
            soles[0, k] = np.where(own[:, None] > 0.0, self._placed[k], soles[0, k])
        targets.points_m[:, SOLES] = soles
        targets.sigma_m[:, SOLES] = np.maximum(sole_sigma_m(corners), LIVE_SIGMA_M)
        return replace(targets, hold=corners)


class Follower:
    """Follows a performer's motion frame by frame: stances, targets, and the robot's configuration."""

    def __init__(self, robot: Robot, frame_s: float, *, at_once: bool = True) -> None:
        """`at_once`: True = the first frame jumps to the performer's pose, False = the robot moves there from its
        stance."""
        self._robot, self._frame_s = robot, frame_s
        self._solver = LiveRobot(robot, frame_s, at_once=at_once)
        self._feet = LiveFeet(robot)
        self._stances: LiveStances | None = None

    def follow(self, frame: Performed, pace: float = 1.0) -> Array:
        """Return the configuration for the next frame of a motion, shape (nq,).

        Args:
            frame: a motion of one frame.
            pace: share of the velocity limits that the hinges may use.
        """
        if self._stances is None:
            self._stances = LiveStances(frame.stand_m, self._frame_s)
        hold = self._stances.follow(np.stack([frame.at[joint][0] for joint in FEET]))
        return self._solver.follow(self._feet.plant(scaled(self._robot, frame), hold), pace)

    def hold(self) -> Array:
        """Return the configuration for a frame without a performer: the robot comes to rest."""
        self._stances, self._feet = None, LiveFeet(self._robot)
        return self._solver.stop()


def followed(
    robot: Robot, motion: Performed, now_s: Callable[[], float] = lambda: 0.0
) -> tuple[Array, Array]:
    """Return the configurations with which a robot follows a motion live, shape (frame_count, nq), and the time that
    each frame took by the clock `now_s` [s], shape (frame_count,).

    Frames use nothing from later ones, except lengths and heights of the performer's body.
    """
    follower = Follower(robot, motion.frame_s)
    out, took = np.empty((len(motion.time_s), robot.model.nq)), np.empty(len(motion.time_s))
    for t in range(len(out)):
        begin_s = now_s()
        out[t] = follower.follow(motion.part(slice(t, t + 1)))
        took[t] = now_s() - begin_s
    return out, took


class LiveRobot:
    """Follows targets frame by frame."""

    def __init__(self, robot: Robot, frame_s: float, *, at_once: bool = True) -> None:
        """`at_once`: as in `Follower`."""
        self._robot, self._frame_s, self._at_once = robot, frame_s, at_once
        model = robot.model
        self._configuration = mink.Configuration(model, robot.standing)
        self._task = JointPositionsTask(robot)
        self._moved = np.concatenate([np.arange(FREE_DOFS), FREE_DOFS + np.flatnonzero(robot.active)])
        """Degrees of freedom that move."""
        self._block = np.ix_(self._moved, self._moved)
        self._qp = BoxQP(len(self._moved))
        self._velocity = np.zeros(model.nv)
        sigma = np.repeat((*BASE_SIGMA, HINGE_SIGMA_RAD_S), (3, 3, model.nv - FREE_DOFS))
        self._stiffness = 1.0 / (sigma * frame_s) ** 2
        rest = np.zeros(model.nv)
        rest[FREE_DOFS:] = 1.0 / REST_RAD**2
        self._rest_stiffness = rest
        self._reach = np.full(model.nv, UNBOUNDED)
        self._reach[FREE_DOFS:] = np.minimum(robot.velocity_rad_s * frame_s, MAX_STEP_RAD)
        self._reach[FREE_DOFS:][~robot.active] = 0.0
        self._low, self._high = robot.bent_rad.T
        self._contacts = ContactFinder(model, robot.active)
        self._moves = body_dofs(model)
        self._started = False
        self._warm_up()

    def follow(self, targets: Targets, pace: float = 1.0) -> Array:
        """Return the configuration for the targets of the next frame, shape (nq,); `pace`: as in `Follower`."""
        self._task.set_targets(targets.points_m[0], 1.0 / targets.sigma_m[0, :, 0])
        if not self._started:
            self._started = True
            hips = targets.points_m[0, [INDEX["left_hip"], INDEX["right_hip"]]].mean(axis=0)
            self._stand_at(hips, targets.hips_wxyz[0])
            if self._at_once:
                self._jump()
                return self._configuration.q.copy()
        self._velocity = VELOCITY_SHARE * self._step(self._velocity, pace)
        return self._configuration.q.copy()

    def stop(self) -> Array:
        """Return the configuration of the next frame without targets, shape (nq,): the robot comes to rest."""
        self._velocity *= STOP_SHARE
        if self._started:
            hinges = self._configuration.q[FREE:]
            step = self._velocity.copy()
            step[FREE_DOFS:] = np.clip(hinges + step[FREE_DOFS:], self._low, self._high) - hinges
            self._configuration.integrate_inplace(step, 1.0)
        return self._configuration.q.copy()

    def _warm_up(self) -> None:
        """Create everything that a first frame needs, by a step at the stance, which moves nothing."""
        self._task.set_targets(self._robot.at_rest_m, np.ones(len(self._robot.at_rest_m)))
        self._step(np.zeros_like(self._velocity), 1.0)
        self._configuration.update(self._robot.standing)

    def _stand_at(self, hips_m: Array, hips_wxyz: Array) -> None:
        """Take the stance, with the hips at the given position."""
        q = self._robot.standing
        rest = self._robot.at_rest_m[[INDEX["left_hip"], INDEX["right_hip"]]].mean(axis=0)
        q[:3] += hips_m - rest
        q[3:FREE] = hips_wxyz
        self._configuration.update(q)

    def _jump(self) -> None:
        """Move to the targets as far as a few steps reach, ignoring velocity limits."""
        reach, self._reach = self._reach, np.where(self._reach > 0.0, FIRST_STEP_RAD, 0.0)
        stiffness, self._stiffness = self._stiffness, np.ones_like(self._stiffness)
        for _ in range(FIRST_ITERATIONS):
            self._step(np.zeros_like(self._velocity), 1.0, apart=False)
        self._reach, self._stiffness = reach, stiffness

    def _step(self, expected: Array, pace: float, *, apart: bool = True) -> Array:
        """Move by one step of mink's problem and return it.

        The step is drawn to `expected`; hinges use at most the share `pace` of their velocity limits. `apart`: parts
        are kept apart.
        """
        problem = _build_ik(self._configuration, [self._task], 1.0, DAMPING, limits=[])
        hinges = self._configuration.q[FREE:]
        H, c = problem.P, problem.q
        diagonal = H.reshape(-1)[:: len(H) + 1]
        diagonal += self._stiffness + self._rest_stiffness
        c -= self._stiffness * expected
        c[FREE_DOFS:] += self._rest_stiffness[FREE_DOFS:] * (hinges - self._robot.rest)
        if apart:
            self._keep_apart(H, c)
        low, high = -self._reach, self._reach.copy()
        low[FREE_DOFS:] *= pace
        high[FREE_DOFS:] *= pace
        np.maximum(low[FREE_DOFS:], np.minimum(self._low - hinges, 0.0), out=low[FREE_DOFS:])
        np.minimum(high[FREE_DOFS:], np.maximum(self._high - hinges, 0.0), out=high[FREE_DOFS:])
        moved = self._moved
        step = np.zeros(len(c))
        step[moved] = self._qp.solve(H[self._block], c[moved], low[moved], high[moved])
        self._configuration.integrate_inplace(step, 1.0)
        return step

    def _keep_apart(self, H: Array, c: Array) -> None:
        """Add the contacts at the configuration to the problem, which push apart parts that are too near."""
        data = self._configuration.data
        bodies, places, ways, distance = self._contacts.found(data)
        if not len(distance):
            return
        rows = contact_rows(places - data.subtree_com[1], ways, data.cdof)
        rows *= self._moves[bodies[:, 1]] - self._moves[bodies[:, 0]]
        rows /= APART_SIGMA_M
        H += rows.T @ rows
        wanted = np.where((bodies == 0).any(axis=1), 0.0, APART_M)
        c -= rows.T @ (np.maximum(wanted - distance, 0.0) / APART_SIGMA_M)
