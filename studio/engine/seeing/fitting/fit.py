"""The body fitted to the points of one instant: Gauss-Newton steps on points, free space, motion and posture.

Source of the method: articulated registration of a body to points, point to surface, as in Ganapathi, Plagemann,
Koller & Thrun, "Real-time human pose tracking from range data", ECCV 2012 (with free space), solved in the tangent of
the chain of hinges; weights by Geman & McClure, 1987.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from studio.engine.base.compiled import compiled
from studio.engine.seeing.fitting.chain import ROOT_DOFS, Chain, Limits, Pose, place_bodies, rows_of
from studio.engine.seeing.fitting.cones import PARTS, Surface, canonical_offsets_of, offsets_of, surface_of
from studio.engine.seeing.fitting.placing import place_cones
from studio.engine.seeing.fitting.surface import match_points
from studio.engine.seeing.images.silhouette import Silhouette, free_space

Array = NDArray[np.float64]

POINT_SIGMA_M = 0.02
"""Standard deviation of a point and of the body's surface [m]."""
POINT_SHARE = 0.1
"""Weight of a point, because errors of neighbouring points are correlated."""
FREE_WEIGHT = 3.0
"""Weight of a sample in free space, in points."""
FREE_REACH_M = 0.15
REACH_M = 0.09
"""Distance at which a point's weight has fallen to a quarter [m]."""
_CROWN = (2, 1.9)
"""A sample just below the top of the head, beyond the end of its axis; it keeps the body inside its silhouette.
"""


class MeasuredPoints(NamedTuple):
    """Measured points of all cameras in the working frame.

    Attributes:
        places, views, normals: points [m], unit vectors to their cameras, measured normals (zero = unknown), each of
            shape (point_count, 3). camera: index of each point's camera, shape (point_count,).
    """

    places: Array
    views: Array
    normals: Array
    camera: NDArray[np.int64]

    @classmethod
    def none(cls) -> "MeasuredPoints":
        """Return no points."""
        nothing = np.zeros((0, 3))
        return cls(nothing, nothing, nothing, np.zeros(0, np.int64))

    def some(self, which: NDArray[np.bool_]) -> "MeasuredPoints":
        """Return the points of `which`, shape (point_count,)."""
        return MeasuredPoints(self.places[which], self.views[which], self.normals[which], self.camera[which])


@dataclass(frozen=True)
class BodyShape:
    """A body of one shape: offsets of its chain and its surface, or only some cones of it if not `whole`."""

    shape: Array
    offsets: Array
    surface: Surface
    whole: bool = True

    @classmethod
    def of(cls, shape: Array) -> "BodyShape":
        return cls(shape, offsets_of(shape), surface_of(shape))

    @cached_property
    def samples(self) -> Array:
        """Places on the cones' axes that are tested for free space; see `free_samples`."""
        return free_samples(self.surface, whole=self.whole)

    def only(self, cones: NDArray[np.int64]) -> "BodyShape":
        """Return the body with these cones of limbs only."""
        return BodyShape(
            self.shape, self.offsets, Surface._make(array[cones] for array in self.surface), whole=False
        )

    @cached_property
    def canonical_offsets(self) -> Array:
        """Offset of each canonical joint from its body's joint in the T-pose [m], shape (21, 3)."""
        return canonical_offsets_of(self.shape)


@dataclass(frozen=True)
class Prior:
    """A prior: an expected pose, the inverse variance of a tangent step from it, shape (6 + dof_count,), and the
    weight of the resting posture.
    """

    pose: Pose
    information: Array
    posture: Array


@dataclass(frozen=True)
class Fit:
    """A pose, its matches with the points, and the normal matrix of the last step.

    Attributes:
        distance: of each point to each part [m], shape (point_count, 5).
        cone: matched cone of each point. offset: signed distance of the point outside its surface [m].
        free: metres in free space of each sample, summed over the cameras, shape (sample_count,).
        information: normal matrix of the last step, shape (6 + dof_count, 6 + dof_count).
    """

    pose: Pose
    distance: Array
    cone: NDArray[np.int64]
    offset: Array
    information: Array


class FitRows(NamedTuple):
    """Rows of a pose's residuals: points, then samples in free space.

    Attributes:
        rows: derivatives by a tangent step, shape (row_count, 6 + dof_count). offsets: residuals [m], shape
            (row_count,). weights: [1/m2], shape (row_count,).
        samples, normals: of the rows in free space, the samples and the directions in which they should move, shapes
            (free_count,) and (free_count, 3).
    """

    rows: Array
    offsets: Array
    weights: Array
    samples: NDArray[np.int64]
    normals: Array


def free_samples(surface: Surface, *, whole: bool = True) -> Array:
    """Return the places that are tested for free space, on the axes of the limbs and, for a whole body, of the head:
    cone, share, shape (n, 2).
    """
    samples = []
    for c, (part, length) in enumerate(zip(surface.part, surface.length, strict=True)):
        if part > 0 or (whole and c < 4):
            shares = (0.25, 0.6, 1.0) if length > 0.12 else (0.5,)
            samples += [(c, share) for share in shares]
    return np.array([*samples, _CROWN] if whole else samples, dtype=np.float64)


def sample_places(figure: BodyShape, origins: Array, frames: Array, samples: Array) -> Array:
    """Return the positions of a figure's samples [m], shape (sample_count, 3); see `free_samples`."""
    cone = samples[:, 0].astype(np.int64)
    return origins[cone] + frames[cone, :, 2] * (samples[:, 1] * figure.surface.length[cone])[:, None]


class Fitter:
    """Fits one chain, of any shape, to points.

    Attributes:
        chain, limits: of the humanoid.
    """

    def __init__(self, chain: Chain, limits: Limits) -> None:
        self.chain, self.limits = chain, limits
        self._dofs = ROOT_DOFS + len(limits.names)

    def place(self, figure: BodyShape, pose: Pose) -> tuple[Array, Array, Array, Array, Array]:
        """Return bodies' positions, rotations, hinges' axes, cones' origins and frames of a pose."""
        places, rotations, axes = place_bodies(
            self.chain, figure.offsets, pose.root, pose.rotation, pose.angles
        )
        return (places, rotations, axes, *place_cones(figure.surface, places, rotations))

    def match(
        self, figure: BodyShape, pose: Pose, points: MeasuredPoints
    ) -> tuple[NDArray[np.int64], Array, Array, Array, Array]:
        """Return the fields of `Matches` of a pose."""
        *_, origins, frames = self.place(figure, pose)
        return match_points(
            points.places, points.views, points.normals, figure.surface, origins, frames, True
        )

    def fit(
        self,
        figure: BodyShape,
        pose: Pose,
        points: MeasuredPoints,
        silhouettes: tuple[Silhouette, ...],
        prior: Prior,
        *,
        iterations: int,
        reach: float = REACH_M,
    ) -> Fit:
        """Return the pose nearest to the points, starting from `pose`."""
        pose, information = self.settled(
            figure, pose, points, silhouettes, prior, iterations=iterations, reach=reach
        )
        cone, _, _, offset, distance = self.match(figure, pose, points)
        return Fit(pose, distance, cone, offset, information)

    def settled(
        self,
        figure: BodyShape,
        pose: Pose,
        points: MeasuredPoints,
        silhouettes: tuple[Silhouette, ...],
        prior: Prior,
        *,
        iterations: int,
        reach: float = REACH_M,
        free: NDArray[np.bool_] | None = None,
        elsewhere: Array | None = None,
    ) -> tuple[Pose, Array]:
        """Return the pose nearest to the points, starting from `pose`, and the normal matrix of the last step.

        Args:
            free: which of the 6 + dof_count steps may be taken; all where None.
            elsewhere: distance of each point to parts outside the figure [m]; points nearer to those are left out.
        """
        information = np.eye(self._dofs)
        for _ in range(iterations):
            rows, offsets, weights, *_ = self.rows(figure, pose, points, silhouettes, reach, elsewhere)
            weighted = rows * weights[:, None]
            information = rows.T @ weighted + np.diag(prior.information + prior.posture)
            gradient = weighted.T @ offsets + prior.information * prior.pose.step_from(pose)
            gradient[ROOT_DOFS:] += prior.posture[ROOT_DOFS:] * (self.limits.rest - pose.angles)
            pose = pose.moved(self.step(information, gradient, pose, free), self.limits)
        return pose, information

    def rows(
        self,
        figure: BodyShape,
        pose: Pose,
        points: MeasuredPoints,
        silhouettes: tuple[Silhouette, ...],
        reach: float = REACH_M,
        elsewhere: Array | None = None,
    ) -> FitRows:
        """Return the residuals of a pose; see `settled`."""
        samples = figure.samples
        places, _, axes, origins, frames = self.place(figure, pose)
        surface = figure.surface
        cone, place, normal, offset, distance = match_points(
            points.places, points.views, points.normals, surface, origins, frames, False
        )
        weight = 1.0 / (1.0 + (distance[:, 0] / reach) ** 2) ** 2
        if elsewhere is not None:
            weight *= distance[:, 0] < elsewhere
        parts = [(surface.body[cone], place, normal, offset, weight)]
        which = [np.zeros(0, dtype=np.int64)]
        for seen in silhouettes:
            *found, sample = free_space(seen, surface, origins, frames, samples)
            parts.append((*found, FREE_WEIGHT / (1.0 + (found[3] / FREE_REACH_M) ** 2)))
            which.append(sample)
        bodies, spots, normals, offsets, weights = (
            np.concatenate(arrays) for arrays in zip(*parts, strict=True)
        )
        rows = np.zeros((len(bodies), self._dofs))
        rows_of(self.chain, places, axes, bodies, spots, normals, rows)
        weights *= POINT_SHARE / POINT_SIGMA_M**2
        return FitRows(rows, offsets, weights, np.concatenate(which), normals[len(cone) :])

    def step(
        self, information: Array, gradient: Array, pose: Pose, free: NDArray[np.bool_] | None = None
    ) -> Array:
        """Return the step of the normal equations. Angles that would leave their limits stay at them, and the others
        are solved again.
        """
        moving = np.ones(self._dofs, dtype=bool) if free is None else free
        step = _limited_step(
            information, gradient, moving, self.limits.low - pose.angles, self.limits.high - pose.angles
        )
        size = np.abs(step)
        step[:3] *= min(1.0, 0.3 / max(size[:3].max(), 1e-9))
        step[3:] *= min(1.0, 0.8 / max(size[3:].max(), 1e-9))
        return step


def part_dofs(limits: Limits) -> dict[str, NDArray[np.bool_]]:
    """Return, by part, which tangent steps move only that limb, shape (6 + dof_count,)."""
    out = {}
    for part in PARTS[1:]:
        side, limb = part.split("_")
        bodies = (
            ("Arm", "ForeArm", "Hand", "Shoulder") if limb == "arm" else ("UpLeg", "Leg", "Foot", "ToeBase")
        )
        own = [name.split("_")[0] in {side.capitalize() + body for body in bodies} for name in limits.names]
        out[part] = np.concatenate([np.zeros(ROOT_DOFS, dtype=bool), np.array(own)])
    return out


@compiled
def _limited_step(information, gradient, free, low, high):
    """Return the step of the normal equations. Steps outside `low` to `high` are clamped, and the others are solved
    again. Steps that are not `free` are 0.
    """
    count = len(gradient)
    root = count - len(low)
    step = np.zeros(count)
    moving = free.copy()
    for _ in range(3):
        index = np.flatnonzero(moving)
        size = len(index)
        matrix = np.empty((size, size))
        target = np.empty(size)
        for i in range(size):
            target[i] = gradient[index[i]]
            for j in range(count):
                if not moving[j]:
                    target[i] -= information[index[i], j] * step[j]
            for j in range(size):
                matrix[i, j] = information[index[i], index[j]]
        target = np.linalg.solve(matrix, target)
        outside = False
        for i in range(size):
            step[index[i]] = target[i]
            k = index[i] - root
            if k >= 0 and (target[i] < low[k] - 1e-9 or target[i] > high[k] + 1e-9):
                step[index[i]] = min(max(target[i], low[k]), high[k])
                moving[index[i]] = False
                outside = True
        if not outside:
            break
    return step
