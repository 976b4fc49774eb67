"""Torques of a robot's motion brought within their limits, where the motion gives way.

Parts of a take with torques beyond their limits are solved again, each with some time around it. Rows of torques keep
what is near its limit within it. Where that is not enough, the rows weigh more with each step, and the motion gives
way: its targets weigh less, accelerations and the relaxed stance more. A robot that stands so is always within limits
that let it stand, so that a weight is found at which all are kept.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import maximum_filter1d, uniform_filter1d

from studio.engine.base.arrays import runs
from studio.engine.robots.body.robot import Robot
from studio.engine.robots.moving.kinematics import Linearised
from studio.engine.robots.moving.solver import (
    APART_M,
    FIRM_ITERATION,
    FLOOR_M,
    RobotSolver,
    apart_m,
    contact_rows,
    overlap_m,
    step_of,
)
from studio.engine.robots.moving.targets import SOLES, STANDS_SIGMA_M, Targets
from studio.engine.robots.moving.torque_rows import LinearTorques, TorqueRows
from studio.engine.robots.moving.torques import BEARS_M, KEPT_SHARE, RobotTorques
from studio.engine.whole_take.finish.banded import BandedNormal, add_rows
from studio.engine.whole_take.finish.smoother import MAX_STEP
from studio.engine.whole_take.finish.trajectory import moved, steps_between
from studio.engine.whole_take.physics.blocks import Blocks

Array = NDArray[np.float64]

PASSES = ((0.4, 14), (0.4, 14), (0.4, 20), (0.4, 40), (1.0, 40))
"""Time before and after torques beyond limits that is solved again [s], and most steps, of each pass. Most torques
need few steps; what is left is a shorter part."""

LONGEST = 1500
"""Most frames that are solved at once."""

STEP = 0.5
"""Share of each step that is gone, since forces of the floor jump from sole to sole."""

FIRMER_STEP, FIRMER, FIRMEST = 4, 1.3, 100.0
"""First step before which rows of torques weigh more where they are beyond, by which factor, and at most."""

GIVES_WAY_STEP, GIVES_WAY, GIVES_MOST = 10, 1.2, 100.0
"""The same of giving way in pose."""

PATIENT, LASTING_S = 2, 0.02
"""Passes in which only torques that are beyond for this time let the motion give way."""

FAR_SHARE = 2.0
"""Torques beyond this share of their limits let the motion give way twice as fast."""

NEAR_S, LEVEL_S = 0.15, 0.3
"""Time around torques beyond limits in which the weights grow, and in which feet that bear alone stay level."""

LEVEL_SIGMA_M = 0.002
"""Deviation of heel from toe, in height, of a foot that bears alone."""

ACTIVE_SETS = 5
"""Most solutions of one step in which rows come in or go out."""

ROUNDING = 1e-9

HELD = 2
"""Frames at either end of a part that stay."""

ANCHOR_S, ANCHOR_RAD = 0.4, (1e-4, 3.0)
"""Time beside them over which the motion comes free, and its deviation there, first and last [rad or m]."""


@dataclass(frozen=True)
class _Part:
    """Successive frames that are solved again.

    Attributes:
        targets: of the robot's points.
        held: frames that stay.
        weight: of the rows of torques at the inner frames, shape (frame_count - 2,); it grows in place.
        ease: how far the motion gives way, from 1 on, shape (frame_count,); it grows in place.
        patient: it gives way only where torques are beyond for `LASTING_S`.
    """

    targets: Targets
    held: NDArray[np.int64]
    weight: Array
    ease: Array
    patient: bool


class GivingWay:
    """Brings a robot's motions within its torques' limits."""

    def __init__(self, robot: Robot, solver: RobotSolver, frame_s: float, *, gives_way: bool) -> None:
        """Args: `gives_way`: also in pose, not only as far as other accelerations do it."""
        self._robot, self._solver, self._frame_s, self._gives_way = robot, solver, frame_s, gives_way
        self._torques = RobotTorques(robot, frame_s)
        self._linear = LinearTorques(robot, self._torques, solver.kinematics.dofs, frame_s)

    def kept(self, q: Array, targets: Targets, apart: bool, progress: Callable[[float], None]) -> Array:
        """Return configurations, shape (frame_count, 7 + active), with torques within their limits, or nearer."""
        if not self._torques.given or len(q) < 2 * HELD + 1:
            return q
        q = q.copy()
        weight, ease = np.ones(len(q) - 2), np.ones(len(q))
        for done, (around_s, count) in enumerate(PASSES if self._can_stand() else PASSES[:1]):
            over = self._shares(q).max(axis=1) > 1.0
            for begin, end in self._parts(over, around_s):
                first = np.arange(HELD if begin > 0 else 0)
                last = end - begin - 1 - np.arange(HELD if end < len(q) else 0)
                rows = slice(begin, end)
                part = _Part(
                    targets.part(rows),
                    np.concatenate([first, last]),
                    weight[begin : end - 2],
                    ease[rows],
                    patient=done < PATIENT,
                )
                q[rows] = self._steps(part, q[rows], count, apart_m(FIRM_ITERATION) if apart else None)
                progress((done + end / len(q)) / len(PASSES))
        return q

    def _shares(self, q: Array) -> Array:
        """Torques of the finished motion as shares of their limits, shape (frame_count - 2, hinge_count)."""
        return self._torques.shares(self._solver.finished(q))

    def _can_stand(self) -> bool:
        """Whether the robot's limits let it stand; otherwise nothing that gives way is within them."""
        standing = np.tile(self._solver.kinematics.reduced(self._robot.standing[None]), (3, 1))
        return float(self._shares(standing).max()) <= 1.0

    def _parts(self, over: NDArray[np.bool_], around_s: float) -> list[tuple[int, int]]:
        """First frame, and one after the last, of parts around frames that are beyond."""
        near = self._around(over, around_s) > ROUNDING
        parts = []
        for begin, end in runs(near):
            for first in range(begin, end, LONGEST):
                parts.append((max(first - HELD, 0), min(first + LONGEST, end) + HELD))
        return [(begin, min(end, len(near))) for begin, end in parts]

    def _around(self, over: NDArray[np.bool_], around_s: float) -> Array:
        """1 around inner frames that are beyond, falling to 0 over the same time, shape (frame_count,)."""
        reach = max(round(around_s / self._frame_s), 1)
        flags = np.concatenate([over[:1], over, over[-1:]]).astype(float)
        return uniform_filter1d(maximum_filter1d(flags, 2 * reach + 1), reach + 1)

    def _lasting(self, over: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """Those frames that are beyond for `LASTING_S`; single ones come and go with a corner that touches down."""
        lasting = np.zeros_like(over)
        for begin, end in runs(over):
            lasting[begin:end] = end - begin > LASTING_S / self._frame_s
        return lasting

    def _anchor(self, frames: int, held: NDArray[np.int64]) -> Array:
        """How stiffly frames are where they were, shape (frame_count,)."""
        if not len(held):
            return np.zeros(frames)
        share = np.abs(np.arange(frames)[:, None] - held).min(axis=1) * self._frame_s / ANCHOR_S
        first, last = ANCHOR_RAD
        return np.where(share < 1.0, 1.0 / (first * (last / first) ** share) ** 2, 0.0)

    def _steps(self, part: "_Part", q: Array, count: int, sigma_m: float | None) -> Array:
        """The best of several steps: least beyond, parts of the robot overlapping by no more than before, or by twice
        `APART_M`."""
        targets, held, weight, ease = part.targets, part.held, part.weight, part.ease
        level, anchor, before = np.zeros(len(q)), self._anchor(len(q), held), q
        best, least, deepest, kept = q, np.inf, 2.0 * APART_M, (weight.copy(), ease.copy())
        for step in range(count + 1):
            at = self._solver.linearised(q, sigma_m)
            most = self._shares(q).max(axis=1)
            beyond, overlap = float(np.maximum(most - 1.0, 0.0).sum()), overlap_m(at.contacts)
            deepest = max(deepest, overlap) if step == 0 else deepest
            if beyond < least and overlap <= deepest:
                best, least, kept = q, beyond, (weight.copy(), ease.copy())
            if least == 0.0:
                break
            near = self._around(most > 1.0, NEAR_S)
            level = np.maximum(level, self._around(most > KEPT_SHARE, LEVEL_S) if step == 0 else near)
            if step >= FIRMER_STEP:
                weight[:] = np.minimum(weight * FIRMER ** near[1:-1], FIRMEST)
            if (step >= GIVES_WAY_STEP or not part.patient) and self._gives_way:
                lasting = self._around(self._lasting(most > 1.0), NEAR_S) if part.patient else near
                far = self._around(most > FAR_SHARE, NEAR_S) * lasting
                ease[:] = np.minimum(ease * GIVES_WAY ** (lasting + far), GIVES_MOST)
            normal = self._solver.normal(q, at, _eased(targets, ease), sigma_m, ease)
            if at.contacts is not None:  # what is weak must not lean on the floor
                contact_rows(normal, at.contacts.part(at.contacts.on_floor), FLOOR_M)
            _level_rows(normal, at, level)
            _anchor_rows(normal, steps_between(q, before), anchor)
            rows = self._linear.rows(self._solver.kinematics.whole(q))
            try:
                ahead = _within(Blocks.of(normal), rows, weight, held)
            except np.linalg.LinAlgError:  # limits far below what the robot's parts weigh
                break
            q = moved(q, STEP * np.clip(ahead, -MAX_STEP, MAX_STEP))
        weight[:], ease[:] = kept
        return best


def _within(blocks: Blocks, rows: TorqueRows, weight: Array, held: NDArray[np.int64]) -> Array:
    """The step of normal equations, with the rows that would be beyond after it."""

    def solved(active: NDArray[np.bool_]) -> tuple[Array, NDArray[np.bool_]]:
        whole = Blocks(blocks.diagonal.copy(), blocks.next.copy(), blocks.second.copy(), blocks.right.copy())
        rows.add_to(whole, active, weight)
        step = step_of(whole, held)
        return step, rows.after(step) > 0.0

    active = rows.beyond > 0.0
    step, then = solved(active)
    for _ in range(ACTIVE_SETS - 1):
        if (then == active).all():
            break
        active = then
        step, then = solved(active)
    return step


def _eased(targets: Targets, ease: Array) -> Targets:
    """Targets that weigh less, but those of standing feet."""
    stands = targets.sigma_m <= 2.0 * STANDS_SIGMA_M
    sigma = np.where(stands, targets.sigma_m, targets.sigma_m * np.sqrt(ease)[:, None, None])
    return replace(targets, sigma_m=sigma, touching=targets.touching / ease[:, None])


def _anchor_rows(normal: BandedNormal, way: Array, stiffness: Array) -> None:
    """Pull configurations along a way, shape (frame_count, nv)."""
    k = np.arange(way.shape[1])
    normal.diagonal[:, k, k] += stiffness[:, None]
    normal.right[:] += stiffness[:, None] * way


def _level_rows(normal: BandedNormal, at: Linearised, level: Array) -> None:
    """Keep a foot level that bears while the other one is not flat on the floor: a foot that bears on its toes alone
    puts the whole weight on the ankle's longest lever."""
    height = at.points_m[:, SOLES, 2].reshape(-1, 2, 2, 2)  # of feet, heel and toe, inner and outer corner
    low, which = height.min(axis=3), height.argmin(axis=3)
    flat, bears = low.max(axis=2) < BEARS_M, low.min(axis=2) < BEARS_M + LEVEL_SIGMA_M
    jacobians = at.jacobians.reshape(len(height), -1, 3, at.jacobians.shape[2])
    for foot in range(2):
        frames = np.flatnonzero((level > 0.0) & bears[:, foot] & ~flat[:, 1 - foot])
        heel, toe = SOLES[foot][which[frames, foot, 0]], SOLES[foot][2 + which[frames, foot, 1]]
        weight = np.sqrt(level[frames]) / LEVEL_SIGMA_M
        rows = weight[:, None] * (jacobians[frames, heel, 2] - jacobians[frames, toe, 2])
        add_rows(normal, frames, rows, weight * (low[frames, foot, 1] - low[frames, foot, 0]))
