"""The performer's shape, estimated together with the pose while the performer is watched.

Lengths and girths are unknowns of the same least squares as the pose, with a prior from anthropometry; what every
frame tells about them is added up (its errors are alike from frame to frame, so a frame counts as a part of one). A
T-pose tells widths, girths and whole limbs; where elbows and knees lie is told once they bend.
"""

import numpy as np
from numpy.typing import NDArray

from studio.engine.tracker.body import SHAPE, SHAPE_REACH, SHAPE_SPREAD
from studio.engine.tracker.chain import ROOT_DOFS
from studio.engine.tracker.fit import Figure, Fit, Fitter, Points, Prior
from studio.engine.tracker.silhouette import Silhouette
from studio.engine.tracker.surface import offsets_from

Array = NDArray[np.float64]

_STEP = 0.01
_FRAME_SHARE = 0.05
"""What a frame tells counts as this share of an independent one."""
_REFRESH = 20
"""Slopes are computed anew after so many updates: the shape changes little."""


class ShapeEstimate:
    """The shape and how surely it is known.

    Attributes:
        mean: shape (13,). information: inverse covariance, shape (13, 13).
    """

    def __init__(self, shape: Array) -> None:
        self.mean = shape.copy()
        self._usual = shape[1:].copy()
        self._shifted: list[Figure] = []
        self._updates = 0
        self.information = np.diag(1.0 / SHAPE_SPREAD**2)

    def update(
        self, fitter: Fitter, fit: Fit, points: Points, silhouettes: tuple[Silhouette, ...], prior: Prior
    ) -> Figure:
        """Take one frame's points at a fitted pose into the estimate; return the body of the new shape."""
        figure = Figure.of(self.mean)
        rows, offsets, weights, which, normals = fitter.rows(figure, fit.pose, points, silhouettes)
        count = len(points.places)
        columns = np.zeros((len(rows), len(SHAPE)))
        if self._updates % _REFRESH == 0:
            self._shifted = _slopes(self.mean, figure)
        self._updates += 1
        samples = figure.samples[which]
        *_, origins, frames = fitter.place(figure, fit.pose)
        spots = _spots(figure, origins, frames, samples)
        for k, slope in enumerate(self._shifted):
            changed = _sum(figure, slope)
            *_, origins, frames = fitter.place(changed, fit.pose)
            there = offsets_from(points.places, points.views, fit.cone, changed.surface, origins, frames)
            columns[:count, k] = (offsets[:count] - there) / _STEP
            moved = _spots(changed, origins, frames, samples) - spots
            columns[count:, k] = np.einsum("ij,ij->i", normals, moved) / _STEP
        pose_weighted, shape_weighted = rows * weights[:, None], columns * weights[:, None]
        pose_part = rows.T @ pose_weighted + np.diag(prior.information + prior.posture)
        pose_gradient = pose_weighted.T @ offsets + prior.information * prior.pose.step_from(fit.pose)
        pose_gradient[ROOT_DOFS:] += prior.posture[ROOT_DOFS:] * (fitter.limits.rest - fit.pose.angles)
        cross = pose_weighted.T @ columns
        solved = np.linalg.solve(pose_part, np.column_stack([cross, pose_gradient]))
        told = _FRAME_SHARE * (columns.T @ shape_weighted - cross.T @ solved[:, :-1])
        gradient = _FRAME_SHARE * (shape_weighted.T @ offsets - cross.T @ solved[:, -1])
        self.information = self.information + told
        step = np.linalg.solve(self.information, gradient)
        mean = self.mean + np.clip(step, -0.03, 0.03)
        mean[1:] = self._usual + np.clip(mean[1:] - self._usual, -SHAPE_REACH[1:], SHAPE_REACH[1:])
        self.mean = mean
        return Figure.of(mean)


def _spots(figure: Figure, origins: Array, frames: Array, samples: Array) -> Array:
    """Return where samples of a figure lie [m], shape (sample_count, 3)."""
    cone = samples[:, 0].astype(np.int64)
    return origins[cone] + frames[cone, :, 2] * (samples[:, 1] * figure.surface.length[cone])[:, None]


_CHANGING = ("origin", "length", "start_radius", "end_radius")


def _slopes(shape: Array, figure: Figure) -> list[Figure]:
    """Return what `_STEP` of each shape number adds to a figure."""
    out = []
    for k in range(len(SHAPE)):
        moved = shape.copy()
        moved[k] += _STEP
        there = Figure.of(moved)
        added = {name: getattr(there.surface, name) - getattr(figure.surface, name) for name in _CHANGING}
        out.append(Figure(moved, there.offsets - figure.offsets, figure.surface._replace(**added)))
    return out


def _sum(figure: Figure, slope: Figure) -> Figure:
    """Return a figure with a slope added."""
    added = {name: getattr(figure.surface, name) + getattr(slope.surface, name) for name in _CHANGING}
    return Figure(slope.shape, figure.offsets + slope.offsets, figure.surface._replace(**added))
