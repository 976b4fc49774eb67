"""Points of cameras that are not triggered together, brought to one instant."""

import numpy as np

from studio.engine.tracker.chain import Pose
from studio.engine.tracker.fit import Figure, Fitter, Points

_LEAST_S = 0.008


def moved_along(fitter: Fitter, figure: Figure, then: Pose, now: Pose, points: Points) -> Points:
    """Return points taken at the pose `then`, each moved with the part of the body it lies on to the pose `now`."""
    if len(points.places) == 0:
        return points
    cone, *_ = fitter.match(figure, then, points)
    body = figure.surface.body[cone]
    places_then, rotations_then, *_ = fitter.place(figure, then)
    places_now, rotations_now, *_ = fitter.place(figure, now)
    turn = rotations_now @ rotations_then.transpose(0, 2, 1)
    moved = places_now[body] + np.einsum("pij,pj->pi", turn[body], points.places - places_then[body])
    normals = np.einsum("pij,pj->pi", turn[body], points.normals)
    return Points(moved, points.views, normals, points.camera)


def worth_moving(seconds: float) -> bool:
    """Whether a delay is long enough to matter."""
    return abs(seconds) > _LEAST_S
