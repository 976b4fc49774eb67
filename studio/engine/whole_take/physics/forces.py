"""Contact forces that best explain a motion: one small non-negative least-squares problem per frame.

Every point near the floor may push with a force inside its friction cone, which is linearised by four edges.
The residual is the part of the external force and moment that these forces cannot explain; a real body has none.
Source: friction cones as edges with non-negative weights, and the residual at the root, as in Shum & Ho,
"Real-time physical modelling of character movements with Microsoft Kinect", VRST 2012.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from studio.engine.whole_take.physics.dynamics import Dynamics
from studio.engine.whole_take.physics.points import FloorPoints

FRICTION = 0.8
"""Coefficient of friction of a shoe or a bare foot on a dry floor."""

BEARING_HEIGHT_M = 0.05
"""Largest height of a bearing point above its resting height on the floor."""

ARM_M = 0.1
"""Lever arm that converts moments to forces in the cost."""

SHARING = 1e-2
"""Weight of the forces relative to the residual; it spreads forces of equal effect over the points."""

EDGES = np.array([[FRICTION, 0, 1], [-FRICTION, 0, 1], [0, FRICTION, 1], [0, -FRICTION, 1]])
EDGES /= np.linalg.norm(EDGES, axis=1, keepdims=True)
"""Edges of a friction cone, shape (4, 3)."""


@dataclass(frozen=True)
class ContactForces:
    """Forces of the floor at the inner frames of a trajectory; K frames, P points.

    Attributes:
        at_points: force at each point [N], shape (K, P, 3).
        residual: unexplained force and moment / `ARM_M` [N], shape (K, 6).
        free: projection onto the directions of (force, moment / `ARM_M`) that the contact forces cannot reach,
            shape (K, 6, 6).
        along: force along each edge of the friction cones [N], shape (K, P, 4).
    """

    at_points: NDArray[np.float64]
    residual: NDArray[np.float64]
    free: NDArray[np.float64]
    along: NDArray[np.float64]


def bearing(motion: Dynamics, points: FloorPoints, floor_m: float) -> NDArray[np.bool_]:
    """Return the points that may bear at the inner frames, shape (K, P); `floor_m` is the floor's height."""
    return motion.points[1:-1, :, 2] - points.flesh_m - floor_m < BEARING_HEIGHT_M


def contact_forces(
    motion: Dynamics, bears: NDArray[np.bool_] | NDArray[np.float64], *, shared: bool = False
) -> ContactForces:
    """Return the forces that best explain the motion.

    Args:
        motion: of K + 2 frames.
        bears: which points may bear, or how firmly, 0..1, shape (K, P); with `shared`, firmer ones cost less.
        shared: spread forces of equal effect over the points; the residual is then slightly larger.
    """
    from scipy.optimize import nnls  # slow to load, and live solves do not need it

    frames, count = bears.shape
    wanted = np.hstack([motion.force, motion.moment / ARM_M])
    along, residual = np.zeros((frames, count, 4)), wanted.copy()
    free = np.broadcast_to(np.eye(6), (frames, 6, 6)).copy()
    effects = effects_at_points(motion, EDGES) * bears[..., None, None]
    for k in np.flatnonzero(bears.any(axis=1)):
        on = bears[k] > 0
        columns = effects[k, on].reshape(-1, 6).T
        size = columns.shape[1]
        if shared:
            rows = np.vstack([columns, SHARING * np.eye(size)])
            weights, _ = nnls(rows, np.concatenate([wanted[k], np.zeros(size)]))
        else:
            weights, _ = nnls(columns, wanted[k])
            used = columns[:, weights > 0.0]
            if used.shape[1]:
                free[k] -= used @ np.linalg.pinv(used)
        along[k, on] = weights.reshape(-1, 4) * bears[k, on, None]
        residual[k] -= columns @ weights
    return ContactForces(along @ EDGES, residual, free, along)


def effects_at_points(motion: Dynamics, directions: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the effects of forces of 1 N at the points on the centre of mass: force [N], moment [N m] over `ARM_M`.

    Args:
        motion: of K + 2 frames.
        directions: of the forces, shape (D, 3).

    Returns:
        Shape (K, P, D, 6).
    """
    arms = (motion.points[1:-1] - motion.com[1:-1, None]) / ARM_M
    moments = np.cross(arms[:, :, None], directions)
    return np.concatenate([np.broadcast_to(directions, moments.shape), moments], axis=3)
