"""The performer's shape, estimated together with the pose during tracking.

Lengths and girths are unknowns of the same least squares as the pose, with a prior from anthropometry. The
information of all frames is added. Errors are correlated between frames, so each counts as a fraction of a frame. A
T-pose shows widths, girths and whole limbs; the places of elbows and knees become known once they bend.
"""

import numpy as np
from numpy.typing import NDArray

from studio.engine.seeing.fitting.chain import ROOT_DOFS
from studio.engine.seeing.fitting.cones import SHAPE, SHAPE_REACH, SHAPE_SPREAD
from studio.engine.seeing.fitting.fit import BodyShape, Fit, Fitter, MeasuredPoints, Prior, sample_places
from studio.engine.seeing.fitting.surface import offsets_from
from studio.engine.seeing.images.silhouette import Silhouette

Array = NDArray[np.float64]

SHAPE_STEP = 0.01
"""Change of a shape parameter from which its slope is computed."""
_FRAME_SHARE = 0.05
"""Weight of a frame relative to an independent one."""
_REFRESH = 20
"""Number of updates after which slopes are computed again; the shape changes little."""


class ShapeEstimate:
    """The shape and its uncertainty.

    Attributes:
        mean: shape (13,). information: inverse covariance, shape (13, 13).
    """

    def __init__(self, shape: Array) -> None:
        self.mean = shape.copy()
        self._usual = shape[1:].copy()
        self._shifted: list[BodyShape] = []
        self._updates = 0
        self.information = np.diag(1.0 / SHAPE_SPREAD**2)

    def update(
        self,
        fitter: Fitter,
        fit: Fit,
        points: MeasuredPoints,
        silhouettes: tuple[Silhouette, ...],
        prior: Prior,
    ) -> BodyShape:
        """Update the estimate with one frame's points at a fitted pose; return the body of the new shape."""
        figure = BodyShape.of(self.mean)
        rows, offsets, weights, which, normals = fitter.rows(figure, fit.pose, points, silhouettes)
        count = len(points.places)
        columns = np.zeros((len(rows), len(SHAPE)))
        if self._updates % _REFRESH == 0:
            self._shifted = shape_slopes(self.mean, figure)
        self._updates += 1
        samples = figure.samples[which]
        *_, origins, frames = fitter.place(figure, fit.pose)
        spots = sample_places(figure, origins, frames, samples)
        for k, slope in enumerate(self._shifted):
            changed = with_slope(figure, slope)
            *_, origins, frames = fitter.place(changed, fit.pose)
            there = offsets_from(points.places, points.views, fit.cone, changed.surface, origins, frames)
            columns[:count, k] = (offsets[:count] - there) / SHAPE_STEP
            moved = sample_places(changed, origins, frames, samples) - spots
            columns[count:, k] = np.einsum("ij,ij->i", normals, moved) / SHAPE_STEP
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
        return BodyShape.of(mean)


_CHANGING = ("origin", "length", "start_radius", "end_radius")


def shape_slopes(shape: Array, figure: BodyShape) -> list[BodyShape]:
    """Return the change of a figure by `SHAPE_STEP` of each shape parameter."""
    out = []
    for k in range(len(SHAPE)):
        moved = shape.copy()
        moved[k] += SHAPE_STEP
        there = BodyShape.of(moved)
        added = {name: getattr(there.surface, name) - getattr(figure.surface, name) for name in _CHANGING}
        out.append(BodyShape(moved, there.offsets - figure.offsets, figure.surface._replace(**added)))
    return out


def with_slope(figure: BodyShape, slope: BodyShape) -> BodyShape:
    """Return a figure with a slope added."""
    added = {name: getattr(figure.surface, name) + getattr(slope.surface, name) for name in _CHANGING}
    return BodyShape(slope.shape, figure.offsets + slope.offsets, figure.surface._replace(**added))
