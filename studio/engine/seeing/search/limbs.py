"""Recovery of lost limbs: a limb that no longer explains its points is searched among poses spread over its reach."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from studio.engine.model.human.humanoid import BODY_JOINTS
from studio.engine.seeing.fitting.chain import ROOT_DOFS, Chain, Limits, Pose, place_bodies
from studio.engine.seeing.fitting.cones import PARTS, part_of
from studio.engine.seeing.fitting.fit import BodyShape, Fitter, MeasuredPoints, Prior, part_dofs
from studio.engine.seeing.fitting.placing import place_limb
from studio.engine.seeing.fitting.surface import points_cost
from studio.engine.seeing.images.silhouette import Silhouette, free_cost, unread_column

Array = NDArray[np.float64]

CANDIDATES = 60
"""Number of poses spread over a limb's reach."""
_DRAWN = 3000
_TARGETS, _PER_TARGET = 4, 10
"""Number of unexplained points tried as targets of the limb's end, and poses for each."""
_CAP_M = 0.15
"""Distances from the body are clipped at this [m]."""
FREE_COST = 4.0
"""Cost of a sample in free space, in points at the same distance."""
_POSTURE_COST_M2 = 0.004
"""Cost of one standard deviation from the resting posture, squared [m2]."""
_REFINED = 2
_ITERATIONS = 6
_UNEXPLAINED_M = 0.07
_ELSEWHERE_M = 0.05
"""A point nearer than this to the rest of the body does not belong to the limb [m]."""
_LOST_M2 = 0.12
"""Cost from which a limb is searched [m2], for a body with 1,000 points."""
_UNREAD_LOST_M2, _UNREAD_SHARE = 0.6, 0.4
"""The same for a limb of which more than this share is unread, so that hands and folds of clothes do not count."""
_RESTING = 16.0
"""Weight of an unread limb's resting posture, relative to the usual weight."""
_BETTER = 0.75
_BETTER_M2 = 0.08
"""Maximum cost of another pose, as a share of the present cost, and its minimum reduction [m2]."""


@dataclass(frozen=True)
class SearchedLimb:
    """One limb: its part, bodies, cones, angles and steps, and its possible poses.

    Attributes:
        poses: angles, shape (pose_count, limb_dof_count); the first `CANDIDATES` are far from each other.
        ends: start of its last cone in these poses, in the frame of the limb's parent body [m], shape (pose_count,
            3).
        samples: places on the limb that are tested for free space; see `free_samples`.
    """

    part: int
    bodies: NDArray[np.int64]
    cones: NDArray[np.int64]
    dofs: NDArray[np.int64]
    moving: NDArray[np.bool_]
    poses: Array
    ends: Array
    samples: Array


class LimbSearch:
    """Searches limbs of one chain."""

    def __init__(self, fitter: Fitter, figure: BodyShape) -> None:
        self._fitter = fitter
        self._moving = part_dofs(fitter.limits)
        self._figure = figure
        self.limbs = tuple(self._limb(part) for part in range(1, len(PARTS)))

    def _limb(self, part: int) -> SearchedLimb:
        moving = self._moving[PARTS[part]]
        dofs = np.flatnonzero(moving[ROOT_DOFS:])
        bodies = np.array([b for b, name in enumerate(BODY_JOINTS) if part_of(name) == part])
        side = "Left" if PARTS[part].startswith("left") else "Right"
        if PARTS[part].endswith("arm"):
            bodies = np.concatenate([[BODY_JOINTS.index(f"{side}Shoulder")], bodies])
        cones = np.flatnonzero(self._figure.surface.part == part)
        poses, ends = spread_poses(self._fitter.chain, self._fitter.limits, self._figure, dofs, bodies, cones)
        samples = self._figure.samples
        own = np.isin(samples[:, 0].astype(int), cones)
        return SearchedLimb(part, bodies, cones, dofs, moving, poses, ends, samples[own])

    def _tried(
        self,
        limb: SearchedLimb,
        figure: BodyShape,
        pose: Pose,
        prior: Prior,
        points: MeasuredPoints,
        lost: Array,
    ) -> Array:
        """Return angles to try: the expected ones, a spread over the reach, and some that reach unexplained points.

        Args:
            lost: distance of each point to the body [m].
        """
        places, rotations, *_ = self._fitter.place(figure, pose)
        base = int(self._fitter.chain.parents[limb.bodies[0]])
        size = _length(figure, limb) / _length(self._figure, limb)
        targets = (points.places - places[base]) @ rotations[base]
        distance = np.where(lost > _UNEXPLAINED_M, np.linalg.norm(targets, axis=1), 0.0)
        out = [prior.pose.angles[limb.dofs][None], limb.poses[:CANDIDATES]]
        for _ in range(_TARGETS):
            if len(distance) == 0 or distance.max() <= 0.0:
                break
            target = targets[int(distance.argmax())]
            near = np.argsort(np.linalg.norm(limb.ends - target / size, axis=1), kind="stable")[:_PER_TARGET]
            out.append(limb.poses[near])
            distance = np.where(np.linalg.norm(targets - target, axis=1) > 0.12, distance, 0.0)
        return np.concatenate(out)

    def cost(
        self, limb: SearchedLimb, figure: BodyShape, pose: Pose, angles: Array, points: MeasuredPoints,
        elsewhere: Array, silhouettes: tuple[Silhouette, ...],
    ) -> Array:  # fmt: skip
        """Return the cost of each candidate [m2], shape (candidate_count,).

        Args:
            angles: of the limb, shape (candidate_count, limb_dof_count).
            elsewhere: distance of each point to the rest of the body [m], shape (point_count,).
        """
        full = np.repeat(pose.angles[None], len(angles), axis=0)
        full[:, limb.dofs] = angles
        places, rotations, _ = place_bodies(
            self._fitter.chain, figure.offsets, pose.root, pose.rotation, pose.angles
        )
        origins, frames = place_limb(
            self._fitter.chain,
            figure.offsets,
            places,
            rotations,
            full,
            limb.bodies,
            figure.surface,
            limb.cones,
        )
        cost = points_cost(
            points.places, points.views, points.normals, elsewhere,
            figure.surface, origins, frames, limb.cones, _CAP_M,
        )  # fmt: skip
        for seen in silhouettes:
            cost += FREE_COST * free_cost(seen, figure.surface, origins, frames, limb.cones, limb.samples)
        limits = self._fitter.limits
        away = (angles - limits.rest[limb.dofs]) / limits.spread[limb.dofs]
        return cost + _POSTURE_COST_M2 * (away**2).mean(axis=1)

    def search(
        self, limb: SearchedLimb, figure: BodyShape, pose: Pose, distance: Array, points: MeasuredPoints,
        silhouettes: tuple[Silhouette, ...], prior: Prior, lost_m2: float = _LOST_M2,
    ) -> tuple[Pose, float]:  # fmt: skip
        """Return the pose, with the limb moved if that reduces the residual enough, and its cost [m2].

        A leg that no camera reads stays unless many points remain unexplained.

        Args:
            distance: of each point to each part [m], shape (point_count, 5), at `pose`.
            lost_m2: a limb with a lower cost stays.
        """
        others = np.delete(distance, limb.part, axis=1).min(axis=1)
        near = others > _ELSEWHERE_M
        places, *_ = self._fitter.place(figure, pose)
        reach = 1.15 * _length(figure, limb) + 0.15
        near &= np.linalg.norm(points.places - places[limb.bodies[0]], axis=1) < reach
        some = points.some(near)
        others = others[near]
        current = pose.angles[limb.dofs][None]
        costs = self.cost(limb, figure, pose, current, some, others, silhouettes)
        scale = min(len(points.places) / 1000.0, 1.0)
        if _is_unread(limb, silhouettes):
            lost_m2 = max(lost_m2, _UNREAD_LOST_M2)
        if costs[0] < lost_m2 * scale:
            return pose, float(costs[0])
        tried = self._tried(limb, figure, pose, prior, some, distance[near].min(axis=1))
        tried_costs = self.cost(limb, figure, pose, tried, some, others, silhouettes)
        best, best_cost, alone = pose, float(costs[0]), figure.only(limb.cones)
        loose = Prior(pose, np.where(limb.moving, 1.0, 1e6), prior.posture)
        for k in np.argsort(tried_costs, kind="stable")[:_REFINED]:
            angles = pose.angles.copy()
            angles[limb.dofs] = tried[k]
            begun = pose.with_angles(angles)
            loose = Prior(begun, loose.information, loose.posture)
            settled, _ = self._fitter.settled(
                alone, begun, some, silhouettes, loose,
                iterations=_ITERATIONS, reach=0.15, free=limb.moving, elsewhere=others,
            )  # fmt: skip
            new = settled.angles[limb.dofs][None]
            cost = float(self.cost(limb, figure, pose, new, some, others, silhouettes)[0])
            if cost < best_cost:
                best, best_cost = settled, cost
        if best_cost < _BETTER * costs[0] and best_cost < costs[0] - _BETTER_M2 * scale:
            return best, best_cost
        return pose, float(costs[0])


def resting(
    prior: Prior, pose: Pose, limbs: tuple[SearchedLimb, ...], silhouettes: tuple[Silhouette, ...]
) -> Prior:
    """Return the prior with limbs that no camera reads kept as in `pose` and drawn to their resting posture."""
    for limb in limbs:
        if _is_unread(limb, silhouettes):
            angles = np.where(limb.moving[ROOT_DOFS:], pose.angles, prior.pose.angles)
            posture = np.where(limb.moving, _RESTING * prior.posture, prior.posture)
            prior = Prior(prior.pose.with_angles(angles), prior.information, posture)
    return prior


def _is_unread(limb: SearchedLimb, silhouettes: tuple[Silhouette, ...]) -> bool:
    """Return whether a large enough share of the limb lacks readings in every image."""
    if not silhouettes:
        return False
    cone = limb.samples[:, 0].astype(np.int64)
    columns = np.array([unread_column(share) for share in limb.samples[:, 1]])
    unread = np.stack([seen.unread[cone, columns] for seen in silhouettes]).all(axis=0)
    return float(unread.mean()) > _UNREAD_SHARE


def _length(figure: BodyShape, limb: SearchedLimb) -> float:
    return float(np.linalg.norm(figure.offsets[limb.bodies], axis=1).sum())


def spread_poses(
    chain: Chain,
    limits: Limits,
    figure: BodyShape,
    dofs: NDArray[np.int64],
    bodies: NDArray[np.int64],
    cones: NDArray[np.int64],
) -> tuple[Array, Array]:
    """Return a limb's poses: angles, shape (pose_count, dof_count), and start of its last cone, (pose_count, 3).

    A Halton sequence covers each angle's usual range within its limits. The joints of each of the first `CANDIDATES`
    poses lie farthest from those of all poses before it (Gonzalez, 1985).
    """
    drawn = np.stack([_halton(_DRAWN, prime) for prime in _PRIMES[: len(dofs)]], axis=1)
    centre, spread = limits.rest[dofs], 2.5 * limits.spread[dofs]
    low, high = np.maximum(limits.low[dofs], centre - spread), np.minimum(limits.high[dofs], centre + spread)
    angles = low + drawn * (high - low)
    full = np.repeat(limits.rest[None], _DRAWN, axis=0)
    full[:, dofs] = angles
    places, rotations, _ = place_bodies(chain, figure.offsets, np.zeros(3), np.eye(3), limits.rest)
    base = int(chain.parents[bodies[0]])
    joints, _ = place_limb(chain, figure.offsets, places, rotations, full, bodies, figure.surface, cones)
    joints = (joints - places[base]) @ rotations[base]
    taken = [0]
    flat = joints.reshape(_DRAWN, -1)
    distance = np.linalg.norm(flat - flat[0], axis=1)
    for _ in range(CANDIDATES - 1):
        taken.append(int(distance.argmax()))
        distance = np.minimum(distance, np.linalg.norm(flat - flat[taken[-1]], axis=1))
    order = np.concatenate([taken, np.setdiff1d(np.arange(_DRAWN), taken)])
    return angles[order], joints[order, -1]


_PRIMES = (2, 3, 5, 7, 11, 13, 17, 19, 23, 29)


def _halton(count: int, base: int) -> Array:
    """Return the first numbers of a Halton sequence, in 0..1, shape (count,)."""
    index, share, out = np.arange(1, count + 1), 1.0, np.zeros(count)
    while index.any():
        share /= base
        out += share * (index % base)
        index //= base
    return out
