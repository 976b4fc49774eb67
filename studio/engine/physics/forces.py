"""Contact forces that explain a motion best: one small non-negative least-squares problem per frame.

Every point near the floor may push with a force inside its friction cone, which is linearised by four edges.
What the forces cannot explain of the external force and moment is the residual, the hand of God that a real body
has not. Source: friction cones as edges with non-negative weights, and the residual at the root, as in Shum & Ho,
"Real-time physical modelling of character movements with Microsoft Kinect", VRST 2012.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import nnls

from studio.engine.physics.dynamics import Dynamics
from studio.engine.physics.points import FloorPoints

FRICTION = 0.8
"""Coefficient of friction of a shoe or a bare foot on a dry floor."""

BEARING_HEIGHT_M = 0.05
"""A point may bear where it is less than this above the height at which it rests on the floor."""

ARM_M = 0.1
"""A moment counts as much as the force that has it at this distance."""

SHARING = 1e-2
"""Forces of equal effect are shared among the points: weight of a force against that of the residual."""

_EDGES = np.array([[FRICTION, 0, 1], [-FRICTION, 0, 1], [0, FRICTION, 1], [0, -FRICTION, 1]])
_EDGES /= np.linalg.norm(_EDGES, axis=1, keepdims=True)


@dataclass(frozen=True)
class ContactForces:
    """What the floor does at the inner frames of a trajectory; K frames, P points.

    Attributes:
        at_points: force at each point [N], shape (K, P, 3).
        residual: force and moment / `ARM_M` that stay unexplained [N], shape (K, 6).
        free: directions of (force, moment / `ARM_M`) in which the forces could not go further, as a projection,
            shape (K, 6, 6).
    """

    at_points: NDArray[np.float64]
    residual: NDArray[np.float64]
    free: NDArray[np.float64]


def bearing(motion: Dynamics, points: FloorPoints, floor_m: float) -> NDArray[np.bool_]:
    """Return which points may bear at the inner frames, shape (K, P); `floor_m` is the floor's height."""
    return motion.points[1:-1, :, 2] - points.flesh_m - floor_m < BEARING_HEIGHT_M


def contact_forces(motion: Dynamics, bears: NDArray[np.bool_], *, shared: bool = False) -> ContactForces:
    """Return the forces that explain the motion best.

    Args:
        motion: of K + 2 frames.
        bears: which points may bear, shape (K, P).
        shared: whether forces of equal effect are shared among points; the residual is then a little greater.
    """
    frames, count = bears.shape
    wanted = np.hstack([motion.force, motion.moment / ARM_M])
    at_points, residual = np.zeros((frames, count, 3)), wanted.copy()
    free = np.broadcast_to(np.eye(6), (frames, 6, 6)).copy()
    arms = (motion.points[1:-1] - motion.com[1:-1, None]) / ARM_M
    effects = np.empty((frames, count, 4, 6))
    effects[..., :3] = _EDGES
    effects[..., 3:] = np.cross(arms[:, :, None], _EDGES)
    for k in np.flatnonzero(bears.any(axis=1)):
        columns = effects[k, bears[k]].reshape(-1, 6).T
        size = columns.shape[1]
        if shared:
            rows = np.vstack([columns, SHARING * np.eye(size)])
            weights, _ = nnls(rows, np.concatenate([wanted[k], np.zeros(size)]))
        else:
            weights, _ = nnls(columns, wanted[k])
            used = columns[:, weights > 0.0]
            if used.shape[1]:
                free[k] -= used @ np.linalg.pinv(used)
        at_points[k, bears[k]] = weights.reshape(-1, 4) @ _EDGES
        residual[k] -= columns @ weights
    return ContactForces(at_points, residual, free)
