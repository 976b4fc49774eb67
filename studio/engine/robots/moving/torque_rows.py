"""Torques of a robot as rows of a least-squares problem: how they change with its motion.

A torque depends on three successive frames: on the pose, velocity and acceleration of the middle one. The forces of
the floor follow from these. Derivatives are taken for two choices of the forces. Those that best explain the motion
within friction cones give the torques that are judged. Those that may also pull give the torques that a pose needs
if its centre of pressure is outside the soles.
"""

from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import NDArray

from studio.engine.robots.body.robot import Robot
from studio.engine.robots.free_joint import FREE_DOFS
from studio.engine.robots.moving.kinematics import body_dofs
from studio.engine.robots.moving.targets import SOLES
from studio.engine.robots.moving.torques import KEPT_SHARE, Strain
from studio.engine.whole_take.finish.trajectory import point_jacobians, steps
from studio.engine.whole_take.physics.blocks import Blocks
from studio.engine.whole_take.physics.forces import ARM_M, EDGES, SHARING, ContactForces

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

NEAR_SHARE = 0.5
"""Share of its limit above which a torque becomes a row, so that no step brings it beyond the limit."""

SIGMA_SHARE = 0.1
"""Standard deviation of a torque beyond `KEPT_SHARE`, as a share of its limit."""

ACROSS = 2.0 * KEPT_SHARE / SIGMA_SHARE
"""Distance between the kept torques of both signs, in deviations."""

EPSILON = 1e-6
"""Step of the finite differences [rad or m], and least eigenvalue of the effects of forces."""


@dataclass(frozen=True)
class TorqueRows:
    """Torques near their limits or beyond, as rows over three successive frames.

    Attributes:
        frames: the first of the three frames, shape (count,).
        rows: derivative of the torque by each reduced degree of freedom, in deviations, shape (count, 3, nv).
        beyond: torque beyond `KEPT_SHARE` of its limit, in deviations; negative = within, shape (count,).
    """

    frames: Indices
    rows: Array
    beyond: Array

    def add_to(self, blocks: Blocks, sides: Indices, weight: Array) -> None:
        """Add the rows that are beyond on a side (`sides_after`), each with the weight of its frame, shape
        (frame_count - 2,)."""
        chosen = sides != 0
        frames = self.frames[chosen]
        root = np.sqrt(weight[frames])
        beyond = np.where(sides > 0, self.beyond, self.beyond + ACROSS)[chosen]
        rows, beyond = root[:, None, None] * self.rows[chosen], root * beyond
        for k in np.unique(frames):
            (before, here, after), left = rows[frames == k].swapaxes(0, 1), beyond[frames == k]
            for frame, one in enumerate((before, here, after), start=int(k)):
                blocks.diagonal[frame] += one.T @ one
                blocks.right[frame] -= left @ one
            blocks.next[k] += before.T @ here
            blocks.next[k + 1] += here.T @ after
            blocks.second[k] += before.T @ after

    def sides_after(self, step: Array) -> Indices:
        """Return the side on which each is beyond after a step: 1 = the present one, -1 = the other, 0 = within."""
        after = self.after(step)
        return np.where(after > 0.0, 1, np.where(after < -ACROSS, -1, 0))

    def after(self, step: Array) -> Array:
        """Return how far each is beyond after a step, shape (frame_count, nv), in the linear approximation."""
        three = np.stack([step[self.frames + k] for k in range(3)], axis=1)
        return self.beyond + np.einsum("fkn,fkn->f", self.rows, three)


@dataclass(frozen=True)
class _Moment:
    """A frame's configuration, velocity and acceleration, the bearing corners, and how firmly each corner bears."""

    q: Array
    velocity: Array
    acceleration: Array
    bearing: Indices
    firm: Array


@dataclass(frozen=True)
class _Choice:
    """Edges of friction cones that forces use: indices of bearing corners (None = any force), and directions, shape
    (count, 3)."""

    corners: Indices | None
    ways: Array


class LinearTorques:
    """Torques of a robot near their limits, and how they change with its motion."""

    def __init__(self, robot: Robot, dofs: Indices, frame_s: float) -> None:
        """Args: `dofs`: the degrees of freedom of the problem."""
        self._robot, self._dofs, self._frame_s = robot, dofs, frame_s
        self._data = mujoco.MjData(robot.model)
        self._sites = robot.site_ids[SOLES.ravel()]
        self._moves = body_dofs(robot.model)[robot.model.site_bodyid[self._sites]]
        self._limit = np.abs(robot.torque_nm).min(axis=1)

    def rows(self, strain: Strain) -> TorqueRows:
        """Return the rows of a motion's torques."""
        way = steps(strain.q)
        velocity = 0.5 * (way[1:] + way[:-1]) / self._frame_s
        acceleration = np.diff(way, axis=0) / self._frame_s**2
        frames, rows, beyond = [np.zeros(0, np.int64)], [np.zeros((0, 3, len(self._dofs)))], [np.zeros(0)]
        near, needed = strain.shares > NEAR_SHARE, strain.needed > NEAR_SHARE
        for k in np.flatnonzero((near | needed).any(axis=1)):
            bearing = np.flatnonzero(strain.firm[k])
            moment = _Moment(strain.q[k + 1], velocity[k], acceleration[k], bearing, strain.firm[k])
            swept = self._swept(moment)
            for choice in _choices(strain.forces, int(k), bearing):
                hinges = np.flatnonzero((needed if choice.corners is None else near)[k])
                one, left = self._of(hinges, swept, choice)
                frames.append(np.full(len(left), k))
                rows.append(one)
                beyond.append(left)
        return TorqueRows(np.concatenate(frames), np.concatenate(rows), np.concatenate(beyond))

    def _of(self, hinges: Indices, swept: "_Swept", choice: _Choice) -> tuple[Array, Array]:
        """Rows of a moment's torques, and how far these are beyond `KEPT_SHARE` of their limits, in deviations."""
        limit = self._limit[hinges]
        torque, pose, turn, push = swept.derivatives(FREE_DOFS + hinges, self._dofs, choice)
        scale = SIGMA_SHARE * limit
        turn, push = turn / (2.0 * self._frame_s), push / self._frame_s**2
        rows = np.stack([push - turn, pose - 2.0 * push, push + turn], axis=1)
        return (np.sign(torque) / scale)[:, None, None] * rows, (np.abs(torque) - KEPT_SHARE * limit) / scale

    def _swept(self, moment: _Moment) -> "_Swept":
        """Forces at a moment, and after a small step in each degree of freedom."""
        model, data, nv = self._robot.model, self._data, self._robot.model.nv
        count = 1 + len(self._dofs)
        configurations = np.tile(moment.q, (count, 1))
        step = np.zeros(nv)
        for row, dof in zip(configurations[1:], self._dofs, strict=True):
            step[dof] = EPSILON
            mujoco.mj_integratePos(model, row, step, 1.0)
            step[dof] = 0.0
        sites = self._sites[moment.bearing]
        force, screws = np.empty((count, nv)), np.empty((count, nv, 6))
        mass, places = np.empty((count, 1, 3)), np.empty((count, len(sites), 3))
        own = np.empty((count, 3, 3))
        fast, inertia = np.empty((len(self._dofs), nv)), np.empty((nv, nv))
        data.qvel[:], data.qacc[:] = moment.velocity, moment.acceleration
        for k in range(count - 1, -1, -1):  # the pose itself comes last
            data.qpos[:] = configurations[k]
            mujoco.mj_kinematics(model, data)
            mujoco.mj_comPos(model, data)
            mujoco.mj_comVel(model, data)
            mujoco.mj_rne(model, data, 1, force[k])
            screws[k], mass[k], own[k] = data.cdof, data.subtree_com[1], data.xmat[1].reshape(3, 3)
            data.site_xpos.take(sites, axis=0, out=places[k], mode="clip")
        mujoco.mj_makeM(model, data)
        mujoco.mj_fullM(model, data, inertia)
        for row, dof in zip(fast, self._dofs, strict=True):
            data.qvel[dof] += EPSILON
            mujoco.mj_comVel(model, data)
            mujoco.mj_rne(model, data, 1, row)
            data.qvel[dof] = moment.velocity[dof]
        ways = point_jacobians(places - mass, screws).reshape(count, len(sites), 3, nv)
        ways *= self._moves[moment.bearing, None] * moment.firm[moment.bearing, None, None]
        return _Swept(force, ways, mass[:, 0] - configurations[:, :3], own, fast, inertia)


@dataclass(frozen=True)
class _Swept:
    """Generalised forces without the floor's, at a moment and after a step in each of n degrees of freedom.

    Attributes:
        force: at the moment, and after each step of the pose, shape (1 + n, nv).
        ways: Jacobians of the bearing corners, times how firmly they bear, shape (1 + n, corner_count, 3, nv).
        centre: centre of mass from the base [m], shape (1 + n, 3).
        own: the base's axes, shape (1 + n, 3, 3).
        fast: forces after each step of the velocity, shape (n, nv).
        inertia: shape (nv, nv).
    """

    force: Array
    ways: Array
    centre: Array
    own: Array
    fast: Array
    inertia: Array

    def derivatives(
        self, hinges: Indices, dofs: Indices, choice: _Choice
    ) -> tuple[Array, Array, Array, Array]:
        """Torques with the floor's forces, shape (hinge_count,), and their derivatives by pose, velocity and
        acceleration, each of the shape (hinge_count, n)."""
        shares = _shares_of_base(self.ways, self.centre, self.own, hinges, choice)
        torque = self.force[:, hinges] - np.matvec(shares, self.force[:, :FREE_DOFS])
        fast = self.fast[:, hinges] - self.fast[:, :FREE_DOFS] @ shares[0].T
        push = self.inertia[hinges] - shares[0] @ self.inertia[:FREE_DOFS]
        pose, turn = (torque[1:] - torque[0]) / EPSILON, (fast - torque[0]) / EPSILON
        return torque[0], pose.T, turn.T, push[:, dofs]


def _choices(forces: ContactForces, k: int, bearing: Indices) -> tuple[_Choice, ...]:
    """The choices of the floor's forces at an inner frame; a single one in the air."""
    free = _Choice(None, np.zeros((0, 3)))
    if not len(bearing):
        return (free,)
    corners, edges = np.nonzero(forces.along[k, bearing] > 0.0)
    return free, _Choice(corners, EDGES[edges])


def _shares_of_base(ways: Array, centre: Array, own: Array, hinges: Indices, choice: _Choice) -> Array:
    """Derivative of hinge torques by the force and moment at the base, through the floor's forces that balance them,
    shape (count, hinge_count, 6).

    Args:
        ways: Jacobians of the bearing corners, times how firmly they bear, shape (count, corner_count, 3, nv).
        centre: centre of mass from the base [m], shape (count, 3).
        own: the base's axes, shape (count, 3, 3).
        hinges: degrees of freedom.
        choice: the choice of forces.
    """
    count, nv = len(ways), ways.shape[3]
    if choice.corners is None:
        across = ways.reshape(count, -1, nv)
    else:
        across = np.einsum("ea,ceaj->cej", choice.ways, ways[:, choice.corners])
    if not across.shape[1]:
        return np.zeros((count, len(hinges), FREE_DOFS))
    to_centre = np.zeros((count, FREE_DOFS, FREE_DOFS))
    to_centre[:, range(3), range(3)] = 1.0
    x, y, z = centre.T / ARM_M
    to_centre[:, 3:, 3:] = own / ARM_M
    to_centre[:, 3, 1], to_centre[:, 3, 2] = z, -y
    to_centre[:, 4, 0], to_centre[:, 4, 2] = -z, x
    to_centre[:, 5, 0], to_centre[:, 5, 1] = y, -x
    effect = np.matmul(
        to_centre, across[..., :FREE_DOFS].swapaxes(1, 2)
    )  # of each force, about the centre of mass
    square = np.matmul(effect, effect.swapaxes(1, 2))
    square[:, range(FREE_DOFS), range(FREE_DOFS)] += EPSILON if choice.corners is None else SHARING**2
    answers = np.matmul(effect.swapaxes(1, 2), np.linalg.solve(square, to_centre))
    return np.matmul(across[..., hinges].swapaxes(1, 2), answers)
