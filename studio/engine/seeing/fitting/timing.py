"""Movement of points to one instant, for cameras that are not triggered together."""

import numpy as np

from studio.engine.seeing.fitting.chain import Pose
from studio.engine.seeing.fitting.fit import BodyShape, Fitter, MeasuredPoints

_LEAST_S = 0.008


def moved_along(
    fitter: Fitter, figure: BodyShape, then: Pose, now: Pose, points: MeasuredPoints
) -> MeasuredPoints:
    """Return points taken at the pose `then`, each moved with its part of the body to the pose `now`."""
    if len(points.places) == 0:
        return points
    cone, *_ = fitter.match(figure, then, points)
    body = figure.surface.body[cone]
    places_then, rotations_then, *_ = fitter.place(figure, then)
    places_now, rotations_now, *_ = fitter.place(figure, now)
    turn = rotations_now @ rotations_then.transpose(0, 2, 1)
    moved = places_now[body] + np.einsum("pij,pj->pi", turn[body], points.places - places_then[body])
    normals = np.einsum("pij,pj->pi", turn[body], points.normals)
    return MeasuredPoints(moved, points.views, normals, points.camera)


def worth_moving(seconds: float) -> bool:
    """Whether a delay is long enough to matter."""
    return abs(seconds) > _LEAST_S
