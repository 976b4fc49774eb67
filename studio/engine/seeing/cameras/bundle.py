"""Bundle adjustment: cameras, poses and one body shape fitted together to the points of many instants.

Every point of a camera should lie on the body of its instant, and every camera's floor on the stage's. The unknowns
are a small movement of each camera, a step of each instant's pose and one shape. The body does not show movements
common to all cameras, such as a turn about the vertical: the prior alone sets them, and it treats all cameras alike.
The shape must be unknown too: a shape learnt under wrong cameras fits those cameras.

Source: Gauss-Newton with the poses eliminated instant by instant, as in Triggs, McLauchlan, Hartley & Fitzgibbon,
"Bundle adjustment, a modern synthesis", 1999, section 6; points against the surface and weights as in
`fitting.fit`.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from studio.engine.base.geometry import make_transform
from studio.engine.seeing.cameras.floors import floor_corners
from studio.engine.seeing.fitting.chain import ROOT_DOFS, Pose, chain_of, rotation_of, rows_of
from studio.engine.seeing.fitting.cones import SHAPE, SHAPE_SPREAD, humanoid_of
from studio.engine.seeing.fitting.fit import POINT_SHARE, POINT_SIGMA_M, BodyShape, Fitter, MeasuredPoints
from studio.engine.seeing.fitting.prediction import PosePredictor
from studio.engine.seeing.fitting.shape import SHAPE_STEP, shape_slopes, with_slope
from studio.engine.seeing.fitting.surface import match_points, offsets_from

Array = NDArray[np.float64]

PLACE_SD_M, TURN_SD_RAD = 0.01, float(np.radians(0.4))
"""Standard deviation of given camera poses on each axis. Boards and tapes err by a few millimetres and tenths of a
degree; some measurements are worse."""
_MOST_STEPS = 25
_STILL = 1e-4
"""Steps end when no camera moves or turns by more than this [m, rad]."""
_REACH_M = 0.05
"""Distance at which a point's weight has fallen to a quarter."""
_FRAME_SHARE = 0.2
"""Weight of an instant, because errors of instants are correlated."""
_FLOOR_SD_M, _FLOOR_REACH_M = 0.01, 0.05
_STEADY = 5.0
"""Information that draws every joint angle to its last value in a step [1/rad2]."""
_LONGEST = 0.2
"""Largest step of a pose [m, rad]."""
_SHAPE_STEP = 0.05
_MOVES = 6


class Bundled(NamedTuple):
    """Result of a bundle adjustment, by camera.

    Attributes:
        T_stage_camera: where each fits best, shape (camera_count, 4, 4).
        residual_m: median distance of its points from the body's surface [m], shape (camera_count,); NaN = no points.
    """

    T_stage_camera: Array
    residual_m: Array


class Instant(NamedTuple):
    """One instant: its initial pose, and its points, whose `camera` is the index among the bundle's cameras."""

    pose: Pose
    points: MeasuredPoints


def bundled(
    instants: Sequence[Instant], shape: Array, T_stage_camera: Array, floors: Sequence[Array | None]
) -> Bundled:
    """Return where the cameras fit best.

    Args:
        instants: at least one.
        shape: initial shape of the body, shape (13,).
        T_stage_camera: the given transforms, which brought the points to the stage, shape (camera_count, 4, 4).
        floors: of each camera in its own frame, see `floor_of`.
    """
    bundle = _Bundle(instants, shape, T_stage_camera, floors)
    for _ in range(_MOST_STEPS):
        if bundle.step() < _STILL:
            break
    return Bundled(bundle.T, bundle.residual_m())


class _Bundle:
    """The unknowns, and the normal equations of the cameras' movements and the shape."""

    def __init__(
        self, instants: Sequence[Instant], shape: Array, given: Array, floors: Sequence[Array | None]
    ) -> None:
        self._instants, self._floors = instants, floors
        self._given, self._usual = given, shape
        self.T = given.copy()
        self._moves = _MOVES * len(given)
        self._moved = np.zeros(self._moves)
        self._figure = BodyShape.of(shape)
        self._poses = [instant.pose for instant in instants]
        self._fitter = Fitter(*chain_of(humanoid_of(shape)))
        self._posture = PosePredictor(self._fitter.limits).posture
        self._least = self._posture + _STEADY * (np.arange(len(self._posture)) >= ROOT_DOFS)
        self._offsets: list[tuple[NDArray[np.int64], Array]] = []
        self._matrix, self._gradient = np.zeros((0, 0)), np.zeros(0)
        prior_sd = [PLACE_SD_M] * 3 + [TURN_SD_RAD] * 3
        self._prior = np.concatenate([np.tile(prior_sd, len(given)), SHAPE_SPREAD]) ** -2.0

    def step(self) -> float:
        """Take one Gauss-Newton step; return the largest movement or turn of a camera in it [m, rad]."""
        self._offsets = []
        self._matrix = np.diag(self._prior)
        self._gradient = -self._prior * np.concatenate([self._moved, self._figure.shape - self._usual])
        slopes = shape_slopes(self._figure.shape, self._figure)
        solved = [self._eliminated(index, slopes) for index in range(len(self._instants))]
        for camera, floor in enumerate(self._floors):
            if floor is not None:
                self._add_floor(camera, floor)
        step = np.linalg.solve(self._matrix, self._gradient)
        for index, (by_step, own) in enumerate(solved):
            change = np.clip(own - by_step @ step, -_LONGEST, _LONGEST)
            self._poses[index] = self._poses[index].moved(change, self._fitter.limits)
        self._moved += step[: self._moves]
        for camera, move in enumerate(step[: self._moves].reshape(-1, _MOVES)):
            turned = rotation_of(move[3:]) @ self.T[camera, :3, :3]
            self.T[camera] = make_transform(turned, self.T[camera, :3, 3] + move[:3])
        change = np.clip(step[self._moves :], -_SHAPE_STEP, _SHAPE_STEP)
        self._figure = BodyShape.of(self._figure.shape + change)
        return float(np.abs(step[: self._moves]).max())

    def residual_m(self) -> Array:
        """Return the median distance of each camera's points from the surface before the last step [m]."""
        cameras, offsets = (np.concatenate(arrays) for arrays in zip(*self._offsets, strict=True))
        own = [np.abs(offsets[cameras == camera]) for camera in range(len(self.T))]
        return np.array([np.median(some) if len(some) else np.nan for some in own])

    def _eliminated(
        self, index: int, slopes: list[BodyShape]
    ) -> tuple[NDArray[np.floating], NDArray[np.floating]]:
        """Add an instant with its pose eliminated; return how its pose responds to a step of the other unknowns,
        shape (dof_count, unknown_count), and its own step, shape (dof_count,)."""
        pose, limits = self._poses[index], self._fitter.limits
        rows, others, offsets, weights = self._rows(pose, self._instants[index].points, slopes)
        weighted, others_weighted = rows * weights[:, None], others * weights[:, None]
        own = rows.T @ weighted + np.diag(self._least + 1e-6)
        gradient = weighted.T @ offsets
        gradient[ROOT_DOFS:] += self._posture[ROOT_DOFS:] * (limits.rest - pose.angles)
        cross = weighted.T @ others
        solved = np.linalg.solve(own, np.column_stack([cross, gradient]))
        self._matrix += _FRAME_SHARE * (others.T @ others_weighted - cross.T @ solved[:, :-1])
        self._gradient += _FRAME_SHARE * (others_weighted.T @ offsets - cross.T @ solved[:, -1])
        return solved[:, :-1], solved[:, -1]

    def _rows(
        self, pose: Pose, points: MeasuredPoints, slopes: list[BodyShape]
    ) -> tuple[Array, Array, Array, Array]:
        """Return for each point the derivatives by the pose, those by the cameras' movements and the shape, the
        residual [m], and the weight [1/m2]."""
        chain, surface, cameras = self._fitter.chain, self._figure.surface, points.camera
        seen = self._placed(points)
        places, _, axes, origins, frames = self._fitter.place(self._figure, pose)
        cone, place, normal, offsets, distance = match_points(
            seen.places, seen.views, seen.normals, surface, origins, frames, False
        )
        self._offsets.append((cameras, offsets))
        rows = np.zeros((len(cone), len(self._least)))
        rows_of(chain, places, axes, surface.body[cone], place, normal, rows)
        others = np.zeros((len(cone), self._moves + len(SHAPE)))
        arms = seen.places - self.T[cameras, :3, 3]
        columns = _MOVES * cameras[:, None] + np.arange(_MOVES)
        moved = np.concatenate([normal, np.cross(arms, normal)], axis=1)
        np.put_along_axis(others, columns, -moved, axis=1)
        for k, slope in enumerate(slopes):
            changed = with_slope(self._figure, slope)
            *_, origins, frames = self._fitter.place(changed, pose)
            there = offsets_from(seen.places, seen.views, cone, changed.surface, origins, frames)
            others[:, self._moves + k] = (offsets - there) / SHAPE_STEP
        weights = POINT_SHARE / POINT_SIGMA_M**2 / (1.0 + (distance[:, 0] / _REACH_M) ** 2) ** 2
        return rows, others, offsets, weights

    def _placed(self, points: MeasuredPoints) -> MeasuredPoints:
        """Return points as placed by the current cameras."""
        move = (self.T @ np.linalg.inv(self._given))[points.camera]
        turn = move[:, :3, :3]
        return MeasuredPoints(
            np.einsum("nij,nj->ni", turn, points.places) + move[:, :3, 3],
            np.einsum("nij,nj->ni", turn, points.views),
            np.einsum("nij,nj->ni", turn, points.normals),
            points.camera,
        )

    def _add_floor(self, camera: int, floor: Array) -> None:
        """Add a camera's floor, whose height should be 0."""
        corners = floor_corners(self.T[camera], floor)
        up = np.tile([0.0, 0.0, 1.0], (len(corners), 1))
        rows = np.concatenate([up, np.cross(corners - self.T[camera, :3, 3], up)], axis=1)
        weights = _FLOOR_SD_M**-2 / (1.0 + (corners[:, 2] / _FLOOR_REACH_M) ** 2) ** 2
        own = slice(_MOVES * camera, _MOVES * (camera + 1))
        self._matrix[own, own] += rows.T @ (rows * weights[:, None])
        self._gradient[own] -= rows.T @ (weights * corners[:, 2])
