"""A part of a robot's motion with torques beyond their limits, solved again until they are within.

Rows of torques keep torques near a limit within it, and weigh more with each step. Where that is not enough, the
motion gives way: its targets weigh less, accelerations and the relaxed stance more. The least change of the motion
then removes any remaining excess. Finally the targets weigh more again, as far as the torques stay within.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import maximum_filter1d, uniform_filter1d

from studio.engine.robots.moving.balance import outside
from studio.engine.robots.moving.kinematics import Linearised
from studio.engine.robots.moving.solver import (
    APART_M,
    FLOOR_M,
    RobotSolver,
    contact_rows,
    overlap_m,
    step_of,
)
from studio.engine.robots.moving.targets import SOLES, STANDS_SIGMA_M, Targets
from studio.engine.robots.moving.torque_rows import LinearTorques, TorqueRows
from studio.engine.robots.moving.torques import BEARS_M, KEPT_SHARE, Strain
from studio.engine.whole_take.finish.banded import BandedNormal, add_rows
from studio.engine.whole_take.finish.smoother import MAX_STEP
from studio.engine.whole_take.finish.trajectory import moved, steps_between
from studio.engine.whole_take.physics.blocks import Blocks

Array = NDArray[np.float64]

STEP, STALE = 0.5, 6
"""Share of each step towards targets that is taken, since forces of the floor jump from sole to sole; maximum number
of steps without a better motion."""

FIRMER_STEP, FIRMER, FIRMEST = 4, 1.3, 100.0
"""First step before which rows of torques beyond limits gain weight, the factor per step, and the maximum weight."""

GIVES_WAY, GIVES_MOST = 1.2, 100.0
"""Factor by which the motion gives way more with each step near torques beyond limits, and its maximum."""

FALLS_SHARE, INSIDE_M, MASS_M, MASS_SIGMA_M = 3.0, 0.02, 0.1, 0.01
"""Share of a torque's limit above which a robot would fall; how far inside the support its centre of mass is brought,
the largest distance by which it is pulled, and its deviation."""

STANDING_UP, STANDS_UP = 16, 1.5
"""Maximum number of steps that bring the centre of mass over the support, and the factor of giving way per step."""

MENDING, SHARES = 3, (1.0, 0.5, 0.2)
"""Maximum number of mending steps without a better motion, and the shares of a step that are tried in turn."""

COMING_BACK, BACK, BACK_STEPS, EASED = 6, 0.7, 4, 1.3
"""How often the targets regain weight, the exponent each time, the steps each time, and how far a motion may still
give way."""

ROUNDING = 1e-9

FIRM = 0.3
"""Deviations of standing soles here, as a share of the usual ones: a robot that is too weak must not slide."""

SLIDES_M_S = 0.005
"""Allowed mean speed of standing corners."""

NEAR_S, LEVEL_S = 0.15, 0.3
"""Time around torques beyond limits in which the weights grow, and in which single supporting feet stay level."""

LEVEL_SIGMA_M = 0.002
"""Deviation in height between heel and toe of a single supporting foot."""

ACTIVE_SETS = 5
"""Maximum number of solutions of one step, between which rows are added or removed."""

HELD = 2
"""Fixed frames at either end of a part."""

ANCHOR_S, ANCHOR_RAD = 0.4, (1e-4, 3.0)
"""Time next to them over which the motion is released, and its first and last deviation there [rad or m]."""


@dataclass(frozen=True)
class NearFrames:
    """Spreads values of inner frames over the time around them."""

    frame_s: float

    def __call__(self, figures: Array | NDArray[np.bool_], around_s: float) -> Array:
        """Return the largest value around each frame, falling off over the same time, shape (frame_count,).

        Args:
            figures: the values, shape (frame_count - 2,).
            around_s: time before and after each frame [s].
        """
        reach = max(round(around_s / self.frame_s), 1)
        all_frames = np.concatenate([figures[:1], figures, figures[-1:]]).astype(float)
        return uniform_filter1d(maximum_filter1d(all_frames, 2 * reach + 1), reach + 1)


@dataclass(frozen=True)
class _Seen:
    """An evaluated motion.

    Attributes:
        q: reduced configurations, shape (frame_count, 7 + active).
        at: the robot's points, contacts and centre of mass.
        strain: the load of the hinges.
        most: the largest torque of inner frames, as a share of its limit, shape (frame_count - 2,).
        beyond: sum over frames of the share of `most` beyond 1.
        overlap_m: largest depth of a part of the robot in another one.
        slide_m_s: mean speed of standing corners on the floor.
    """

    q: Array
    at: Linearised
    strain: Strain
    most: Array
    beyond: float
    overlap_m: float
    slide_m_s: float


class StrainedPart:
    """Successive frames that are solved again.

    Attributes:
        q: the best motion yet, shape (frame_count, 7 + active).
        weight: weight of the torque rows at the inner frames, shape (frame_count - 2,).
        ease: how far the motion gives way, 1 = not at all, shape (frame_count,).
    """

    def __init__(
        self,
        solver: RobotSolver,
        strain: Callable[[Array], Strain],
        linear: LinearTorques,
        targets: Targets,
        q: Array,
        *,
        held: NDArray[np.int64],
        weight: Array,
        ease: Array,
        apart_m: float | None,
    ) -> None:
        """Args: `strain`: of reduced configurations. `held`: fixed frames. `apart_m`: as `RobotSolver.normal`."""
        self._solver, self._strain, self._linear, self._targets = solver, strain, linear, targets
        self._held, self._apart_m = held, apart_m
        self.weight, self.ease = weight.copy(), ease.copy()
        self._around = NearFrames(targets.frame_s)
        self._anchor = _anchor(len(q), held, targets.frame_s)
        self._before = q
        self._best = self._seen(q)
        self._deepest = max(2.0 * APART_M, self._best.overlap_m)
        self._fastest = max(SLIDES_M_S, self._best.slide_m_s)
        self._level = self._around(self._best.most > KEPT_SHARE, LEVEL_S)

    @property
    def q(self) -> Array:
        return self._best.q

    def stand_up(self) -> None:
        """Bring the centre of mass over the soles where the robot would fall: torque rows show no way back there."""
        q, ease = self._best.q, self.ease.copy()
        falls = np.zeros(len(q), dtype=bool)
        for _ in range(STANDING_UP):
            seen = self._seen(q)
            falls[1:-1] |= (seen.strain.needed > FALLS_SHARE).any(axis=1)
            soles = seen.at.points_m[:, SOLES]
            way = outside(seen.at.mass_m, soles, self._targets.standing & falls[:, None, None], INSIDE_M)
            length = np.linalg.norm(way, axis=1)
            away = length > INSIDE_M
            if not away.any():
                break
            ease = np.minimum(ease * STANDS_UP ** self._around(away[1:-1], NEAR_S), GIVES_MOST)
            way *= np.minimum(1.0, MASS_M / np.maximum(length, ROUNDING))[:, None]
            normal = self._normal(seen, ease)
            assert seen.at.mass_jacobians is not None
            rows = seen.at.mass_jacobians[away, :2].reshape(-1, normal.right.shape[1])
            add_rows(
                normal,
                np.repeat(np.flatnonzero(away), 2),
                rows / MASS_SIGMA_M,
                way[away].ravel() / MASS_SIGMA_M,
            )
            _anchor_rows(normal, steps_between(q, self._before), self._anchor)
            q = moved(q, np.clip(step_of(normal, self._held), -MAX_STEP, MAX_STEP))
        if falls.any():
            self._best, self.ease = self._seen(q), ease

    def approach(self, count: int, *, gives_way: bool) -> None:
        """Take steps towards the targets and the torques' limits.

        Args:
            count: maximum number of steps.
            gives_way: targets weigh less near torques beyond their limits.
        """
        seen, weight, ease, stale = self._best, self.weight, self.ease, 0
        for step in range(count):
            if seen.beyond == 0.0 or (stale == STALE and not gives_way):
                break
            near = self._around(seen.most > 1.0, NEAR_S)
            self._level = np.maximum(self._level, near)
            if step >= FIRMER_STEP:
                weight = np.minimum(weight * FIRMER ** near[1:-1], FIRMEST)
            if gives_way:
                ease = np.minimum(ease * GIVES_WAY**near, GIVES_MOST)
            seen = self._nearer(seen, weight, ease)
            stale += 1
            if self._better(seen):
                self._best, self.weight, self.ease, stale = seen, weight, ease, 0

    def mend(self) -> None:
        """Bring torques within their limits by the least changes of the best motion. Targets resist changes, but do
        not pull."""
        for share in SHARES:
            seen, left = self._best, MENDING
            while left and self._best.beyond > 0.0:
                seen = self._mended(seen, share)
                left -= 1
                if self._better(seen):
                    self._best, left = seen, MENDING

    def _mended(self, seen: _Seen, share: float) -> _Seen:
        """The motion after a share of the least step that brings torques within their limits."""
        normal = self._normal(seen, self.ease, pulls=False)
        _anchor_rows(normal, np.zeros_like(normal.right), self._anchor)
        ahead = self._ahead(seen, normal, np.full_like(self.weight, FIRMEST))
        return self._seen(moved(seen.q, share * ahead))

    def come_back(self) -> None:
        """Let the targets weigh more again, as far as torques stay within their limits."""
        for _ in range(COMING_BACK):
            kept = self._best, self.ease
            if self._best.beyond > 0.0 or self.ease.max() < EASED:
                return
            self.ease = self.ease**BACK
            for _ in range(BACK_STEPS):
                self._best = self._nearer(self._best, self.weight, self.ease)
            self.mend()
            if self._best.beyond > 0.0 or not self._allowed(self._best):
                self._best, self.ease = kept
                return

    def _seen(self, q: Array) -> _Seen:
        at = self._solver.kinematics.linearised(q, contacts=self._apart_m is not None, mass=True)
        strain = self._strain(q)
        most = strain.shares.max(axis=1)
        beyond = float(np.maximum(most - 1.0, 0.0).sum())
        return _Seen(q, at, strain, most, beyond, overlap_m(at.contacts), self._slide_m_s(strain))

    def _slide_m_s(self, strain: Strain) -> float:
        stands = self._targets.standing[1:] & self._targets.standing[:-1]
        if not stands.any():
            return 0.0
        ways = np.diff(strain.soles_m[..., :2], axis=0)[stands.reshape(len(stands), -1)]
        return float(np.linalg.norm(ways, axis=1).mean()) / self._targets.frame_s

    def _better(self, seen: _Seen) -> bool:
        """Whether the excess of torques is smaller than in the best motion, and the motion is allowed."""
        return seen.beyond < self._best.beyond and self._allowed(seen)

    def _allowed(self, seen: _Seen) -> bool:
        """Whether parts overlap and standing feet slide no more than before, or only a little."""
        return seen.overlap_m <= self._deepest and seen.slide_m_s <= self._fastest

    def _nearer(self, seen: _Seen, weight: Array, ease: Array) -> _Seen:
        """The motion after a step towards the targets and the torques' limits."""
        normal = self._normal(seen, ease)
        _level_rows(normal, seen.at, self._level)
        _anchor_rows(normal, steps_between(seen.q, self._before), self._anchor)
        return self._seen(moved(seen.q, STEP * self._ahead(seen, normal, weight)))

    def _normal(self, seen: _Seen, ease: Array, *, pulls: bool = True) -> BandedNormal:
        """The normal equations of a motion that gives way; `pulls`: False = only the floor pulls."""
        normal = self._solver.normal(seen.q, seen.at, _eased(self._targets, ease), self._apart_m, ease)
        if not pulls:
            normal.right[:] = 0.0
        if seen.at.contacts is not None:  # a weak robot must not lean on the floor
            contact_rows(normal, seen.at.contacts.part(seen.at.contacts.on_floor), FLOOR_M)
        return normal

    def _ahead(self, seen: _Seen, normal: BandedNormal, weight: Array) -> Array:
        """The step of normal equations with rows of torques; 0 where limits are far below the weight of the robot's
        parts."""
        try:
            ahead = _within(Blocks.of(normal), self._linear.rows(seen.strain), weight, self._held)
        except np.linalg.LinAlgError:
            return np.zeros_like(normal.right)
        return np.clip(ahead, -MAX_STEP, MAX_STEP)


def _within(blocks: Blocks, rows: TorqueRows, weight: Array, held: NDArray[np.int64]) -> Array:
    """The step of normal equations with the rows of torques that would be beyond their limits after it."""

    def solved(sides: NDArray[np.int64]) -> tuple[Array, NDArray[np.int64]]:
        whole = Blocks(blocks.diagonal.copy(), blocks.next.copy(), blocks.second.copy(), blocks.right.copy())
        rows.add_to(whole, sides, weight)
        step = step_of(whole, held)
        return step, rows.sides_after(step)

    sides = (rows.beyond > 0.0).astype(np.int64)
    step, then = solved(sides)
    for _ in range(ACTIVE_SETS - 1):
        if (then == sides).all():
            break
        sides = then
        step, then = solved(sides)
    return step


def _eased(targets: Targets, ease: Array) -> Targets:
    """Targets that weigh less, except those of standing feet, which weigh more."""
    stands = targets.sigma_m <= 2.0 * STANDS_SIGMA_M
    sigma = targets.sigma_m * np.where(stands, FIRM, np.sqrt(ease)[:, None, None])
    return replace(targets, sigma_m=sigma, touching=targets.touching / ease[:, None])


def _anchor(frames: int, held: NDArray[np.int64], frame_s: float) -> Array:
    """Stiffness with which frames keep their configuration, shape (frame_count,)."""
    if not len(held):
        return np.zeros(frames)
    share = np.abs(np.arange(frames)[:, None] - held).min(axis=1) * frame_s / ANCHOR_S
    first, last = ANCHOR_RAD
    return np.where(share < 1.0, 1.0 / (first * (last / first) ** share) ** 2, 0.0)


def _anchor_rows(normal: BandedNormal, way: Array, stiffness: Array) -> None:
    """Pull configurations along a step, shape (frame_count, nv)."""
    k = np.arange(way.shape[1])
    normal.diagonal[:, k, k] += stiffness[:, None]
    normal.right[:] += stiffness[:, None] * way


def _level_rows(normal: BandedNormal, at: Linearised, level: Array) -> None:
    """Keep a supporting foot level while the other one is not flat on the floor: support on the toes alone puts the
    whole weight on the ankle's longest lever."""
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
